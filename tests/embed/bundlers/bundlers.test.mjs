// The npm package by vite, webpack, esbuild and no bundler at all, each as docs/wasm.md says, in a browser.
//
//   node --test bundlers.test.mjs, with
//   CAB_WORK      a folder with these files, and node_modules by `npm ci` with the package cab-collision in it
//   CAB_BROWSER   Chromium
//   CAB_PICTURES  where pictures of the pages of three.js are written, PAGE.png. Default: nowhere
import assert from 'node:assert/strict';
import {createReadStream, cpSync, existsSync, mkdirSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {createServer} from 'node:http';
import {createRequire} from 'node:module';
import {extname, join} from 'node:path';
import {after, before, test} from 'node:test';
import {pathToFileURL} from 'node:url';

const work = process.env.CAB_WORK;
const require = createRequire(join(work, 'package.json'));
const EXPECTED = 'link 1 of arm 0 touches link 0 of arm 1';
// What the titles of the pages of three.js say.
const TITLES = {
  skinned: /^[1-9][0-9]+ pairs of triangles touch$/,
  walk: /^[1-9][0-9]+ pairs of links touch$/,
};
const MIME = {'.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm'};

const vite = await import(pathToFileURL(join(work, 'node_modules/vite/dist/node/index.js')));
const esbuild = require('esbuild');
const webpack = require('webpack');

let browser;
before(async () => {
  browser = await require('puppeteer-core').launch({
    executablePath: process.env.CAB_BROWSER,
    headless: true,
    args: ['--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader', '--no-first-run', '--disable-sync',
           '--disable-background-networking', '--disable-component-update'],
  });
});
after(() => browser?.close());

// Opens a page until `answer` is the result of `expression`, or the page has errors: returns the result and the errors.
// picture: the name of a picture of it, if one is wanted.
async function seen(url, expression, answer, picture) {
  const tab = await browser.newPage(), wrong = [];
  await tab.setViewport({width: 800, height: 500});
  tab.on('pageerror', (error) => wrong.push(error.message));
  tab.on('console', (message) => {
    if (message.type() === 'error' && !message.location().url.endsWith('favicon.ico')) wrong.push(message.text());
  });
  await tab.goto(url);
  let found;
  for (const begin = Date.now(); Date.now() - begin < 30000 && !wrong.length;) {
    found = await tab.evaluate(expression).catch(() => '');  // the page is loaded anew once vite has found packages
    if (answer.test(found)) break;
    await new Promise((done) => setTimeout(done, 50));
  }
  if (picture && process.env.CAB_PICTURES) {
    await tab.screenshot({path: join(process.env.CAB_PICTURES, `${picture}.png`)});
  }
  await tab.close();
  return {found, wrong};
}

async function look(url, expression, answer, picture) {
  const {found, wrong} = await seen(url, expression, answer, picture);
  assert.deepEqual(wrong, []);
  assert.match(found, answer);
}

const seesArms = (url) => look(url, 'document.body.textContent.trim()', new RegExp(`^${EXPECTED}$`));
const sees = (page) => page in TITLES ? (url) => look(url, 'document.title', TITLES[page], page) : seesArms;

// Serves the files of a folder while `use(address)` runs.
async function served(folder, use) {
  const server = createServer(({url}, response) => {
    const file = join(folder, decodeURIComponent(new URL(url, 'http://localhost').pathname));
    if (!file.startsWith(folder) || !existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, {'content-type': MIME[extname(file)] ?? 'application/octet-stream'});
    createReadStream(file).pipe(response);
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  try {
    await use(`http://127.0.0.1:${server.address().port}`);
  } finally {
    server.closeAllConnections();
    server.close();
  }
}

// An empty folder for what a bundler writes, with a page for a script, if there is one.
function outputFolder(name, script) {
  const folder = join(work, 'dist', name);
  rmSync(folder, {recursive: true, force: true});
  mkdirSync(folder, {recursive: true});
  if (script) {
    writeFileSync(join(folder, 'index.html'),
                  `<!doctype html><meta charset="utf-8"><body></body><script type="module" src="${script}"></script>`);
  }
  return folder;
}

const configOf = (page) => page === 'by_file' ? join(work, 'vite.config.js') : false;

// Runs Vite's development server while `use(address)` runs.
async function developed(page, configFile, use) {
  const server = await vite.createServer({
    root: work, configFile, logLevel: 'silent', cacheDir: join(work, 'dist', `cache-${page}-${Boolean(configFile)}`),
    server: {port: 0, host: '127.0.0.1'}, optimizeDeps: {entries: [`${page}.html`]},
  });
  await server.listen();
  try {
    await use(`${server.resolvedUrls.local[0]}${page}.html`);
  } finally {
    await server.close();
  }
}

for (const page of ['by_file', 'by_inline', 'by_url_vite', 'skinned', 'walk']) {
  test(`vite, the development server: ${page}`, () => developed(page, configOf(page), sees(page)));

  test(`vite, a build: ${page}`, async () => {
    const folder = outputFolder(`vite-${page}`);
    await vite.build({
      root: work, configFile: configOf(page), logLevel: 'error', base: './',
      build: {outDir: folder, rollupOptions: {input: join(work, `${page}.html`)}, chunkSizeWarningLimit: 4000},
    });
    await served(folder, (address) => sees(page)(`${address}/${page}.html`));
  });
}

test('vite, the development server without its recipe: the error names the document', async () => {
  rmSync(join(work, 'dist/cache-by_file-false'), {recursive: true, force: true});
  await developed('by_file', false, async (url) => {
    const {wrong} = await seen(url, 'document.body.textContent.trim()', new RegExp(`^${EXPECTED}$`));
    assert.match(wrong.join(), /cab_simd.wasm: 404 Not Found; a bundler may not have copied it: docs\/wasm.md has/);
  });
});

for (const page of ['by_file', 'by_inline']) {
  test(`webpack: ${page}`, async () => {
    const folder = outputFolder(`webpack-${page}`, 'bundle.js');
    const stats = await new Promise((done, failed) => webpack({
      mode: 'production', context: work, entry: `./${page}.js`, output: {path: folder, filename: 'bundle.js'},
      performance: false,
    }, (error, result) => error ? failed(error) : done(result)));
    assert.deepEqual(stats.toJson().errors, []);
    assert.deepEqual(stats.toJson().warnings, []);
    await served(folder, (address) => seesArms(`${address}/index.html`));
  });
}

for (const page of ['by_file', 'by_inline', 'by_url_esbuild', 'skinned']) {
  test(`esbuild: ${page}`, async () => {
    const folder = outputFolder(`esbuild-${page}`, `${page}.js`);
    const {errors, warnings} = await esbuild.build({
      absWorkingDir: work, entryPoints: [`${page}.js`], bundle: true, format: 'esm', outdir: folder, logLevel: 'silent',
      loader: {'.wasm': 'file'},
    });
    assert.deepEqual([...errors, ...warnings], []);
    if (page === 'by_file') {
      for (const file of ['cab_simd.wasm', 'cab_scalar.wasm']) {
        cpSync(join(work, 'node_modules/cab-collision', file), join(folder, file));
      }
    }
    await served(folder, (address) => sees(page)(`${address}/index.html`));
  });
}

test('no bundler: an import map', async () => {
  const folder = outputFolder('none', 'by_file.js');
  for (const file of ['arms.js', 'by_file.js']) cpSync(join(work, file), join(folder, file));
  cpSync(join(work, 'node_modules/cab-collision'), join(folder, 'node_modules/cab-collision'), {recursive: true});
  const map = JSON.stringify({imports: {'cab-collision': './node_modules/cab-collision/index.js'}});
  writeFileSync(join(folder, 'index.html'), `<!doctype html><meta charset="utf-8"><body></body>` +
    `<script type="importmap">${map}</script><script type="module" src="by_file.js"></script>`);
  await served(folder, (address) => seesArms(`${address}/index.html`));
});

test('a server that answers every address by one page is named as what it is', async () => {
  const folder = outputFolder('lost');
  writeFileSync(join(folder, 'index.html'), '<!doctype html>');
  await served(folder, async (address) => {
    const {load} = await import(pathToFileURL(join(work, 'node_modules/cab-collision/index.js')));
    await assert.rejects(load({url: `${address}/index.html`}), /is no WebAssembly module; a bundler may not have/);
    await assert.rejects(load({url: `${address}/none.wasm`}), /none.wasm: 404/);
  });
});
