// Builds the viewer page, cab_view.html, and bundles node programs of tests.
//
//   node build.mjs --package DIR --work DIR [--program FILE.ts ...] [--no-page]
//
//   --package  the built npm package of the engine: index.js, abi.js, cab_simd.wasm, cab_scalar.wasm
//   --work     where packages are installed, code is generated, bundles are made and cab_view.html is written. It may
//              be kept between builds
//   --program  a node program to check and to bundle, into WORK/programs/FILE.mjs
//   --no-page  makes the programs alone
//
// The folder of --work gets links to the sources, so that packages are found beside them and the sources stay clean:
// WORK/perf/view, WORK/tests/view, WORK/node_modules. Sources import the generated code as `recording-format` and the
// engine as `cab-collision`.
import {execFileSync} from 'node:child_process';
import {createHash} from 'node:crypto';
import {
  cpSync, existsSync, lstatSync, mkdirSync, readFileSync, rmSync, symlinkSync, unlinkSync, writeFileSync,
} from 'node:fs';
import {createRequire} from 'node:module';
import {basename, dirname, join, relative, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {deflateRawSync} from 'node:zlib';

const MOST_BYTES = 4 * 1024 * 1024;
const DATA_LINE = '<!--CAB-DATA-->';

const source = dirname(fileURLToPath(import.meta.url));
const root = resolve(source, '../..');

function readOptions() {
  const {values} = parseArgs({
    options: {
      package: {type: 'string'},
      work: {type: 'string'},
      program: {type: 'string', multiple: true, default: []},
      'no-page': {type: 'boolean', default: false},
    },
  });
  for (const name of ['package', 'work']) {
    if (values[name] === undefined) throw new Error(`--${name} DIR is missing`);
  }
  return {
    package: resolve(values.package),
    work: resolve(values.work),
    programs: values.program.map((file) => resolve(file)),
    page: !values['no-page'],
  };
}

// Runs a program, whose words are seen.
function run(program, args, options = {}) {
  try {
    execFileSync(program, args, {stdio: 'inherit', ...options});
  } catch (error) {
    throw error.code === 'ENOENT' ? new Error(`there is no program ${program}`) : error;
  }
}

const sameText = (a, b) => existsSync(a) && existsSync(b) && readFileSync(a, 'utf8') === readFileSync(b, 'utf8');

// Installs what the lock file says, if that is not there yet.
function installPackages(work) {
  const installed = join(work, 'node_modules', '.cab-lock.json');
  const lock = join(source, 'package-lock.json');
  cpSync(join(source, 'package.json'), join(work, 'package.json'));
  if (sameText(lock, installed)) return;
  cpSync(lock, join(work, 'package-lock.json'));
  run('npm', ['ci', '--ignore-scripts', '--no-audit', '--no-fund', '--loglevel=error'], {cwd: work});
  cpSync(lock, installed);
}

function link(target, at) {
  mkdirSync(dirname(at), {recursive: true});
  if (lstatSync(at, {throwIfNoEntry: false})) unlinkSync(at);
  symlinkSync(target, at, 'junction');
}

function linkSources({work, package: enginePackage}) {
  link(source, join(work, 'perf/view'));
  link(join(root, 'tests/view'), join(work, 'tests/view'));
  link(enginePackage, join(work, 'engine_package'));
}

function generateFormat({work}) {
  const generated = join(work, 'generated');
  rmSync(generated, {recursive: true, force: true});
  run('flatc', ['--ts', '-o', generated, join(root, 'engine/record/recording.fbs')]);
}

// Two projects, since the page has no node and node has no page.
function checkTypes({work, page, programs}) {
  const check = (name, types, files) => {
    const project = join(work, `tsconfig.${name}.json`);
    writeFileSync(project, JSON.stringify({
      extends: './perf/view/tsconfig.json',
      compilerOptions: {
        types,
        paths: {
          'recording-format': ['./generated/recording_generated.ts'],
          'cab-collision': ['./engine_package/index.d.ts'],
        },
      },
      files,
    }));
    const tsc = createRequire(join(work, 'package.json')).resolve('typescript/bin/tsc');
    run(process.execPath, [tsc, '--project', project], {cwd: work});
  };
  if (page) check('page', [], ['perf/view/src/main.ts']);
  if (programs.length > 0) check('programs', ['node'], programs.map((file) => linked(work, file)));
}

// The path of a source file through the links in the work folder.
const linked = (work, file) => join(work, relative(root, file));

function bundler(work) {
  const esbuild = createRequire(join(work, 'package.json'))('esbuild');
  const alias = {
    'recording-format': join(work, 'generated/recording_generated.ts'),
    'cab-collision': join(work, 'engine_package/index.js'),
  };
  return (options) => esbuild.buildSync({
    absWorkingDir: work,
    bundle: true,
    preserveSymlinks: true,
    target: 'es2022',
    logLevel: 'warning',
    tsconfigRaw: {compilerOptions: {strict: true, verbatimModuleSyntax: true}},
    alias,
    ...options,
  });
}

// Licences of cab and of all whose code is in the page. They go into its first lines.
function notices({work, package: enginePackage}, inputs) {
  const list = join(work, 'LICENSE.third-party');
  run('cmake', ['-D', 'WORDS=page;wasm', '-D', `FILE=${list}`, '-P', join(root, 'cmake/third_party.cmake')]);
  const others = readFileSync(list, 'utf8');
  for (const input of Object.keys(inputs)) {
    const name = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input)?.[1];
    if (name === undefined) continue;
    const {version, license} = JSON.parse(readFileSync(join(work, 'node_modules', name, 'package.json'), 'utf8'));
    if (!others.includes(`\n==== ${name} ${version}\nLicense: ${license}\n`)) {
      throw new Error(`${name} ${version}, ${license}, is in the page, and no part of LICENSE.third-party is about it`);
    }
  }
  return `cab\n\n${readFileSync(join(enginePackage, 'LICENSE'), 'utf8').trim()}\n\n${others.trim()}`;
}

const escapeHtml = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;');

// A script element ends at the first `</script`, and `<!--` changes how it is read, wherever they stand.
const scriptText = (code) => code.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');

// What a browser lets the page do: run its one script and WebAssembly, apply its one style, and show images that it
// makes itself. Whatever a recording or a report puts into the page runs nothing and asks nothing of a network.
function policyOf(script, style) {
  const hash = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
  return `default-src 'none'; script-src ${hash(script)} 'wasm-unsafe-eval'; style-src ${hash(style)}; ` +
      "img-src data:; base-uri 'none'; form-action 'none'";
}

function buildPage(options, bundle) {
  const {work, package: enginePackage} = options;
  const built = bundle({
    entryPoints: [join(work, 'perf/view/src/main.ts')],
    outfile: join(work, 'bundle/main.js'),
    format: 'iife',
    minify: true,
    charset: 'ascii',
    legalComments: 'none',
    metafile: true,
    write: false,
    loader: {'.css': 'css'},
    external: ['node:*'],
    // The engine's package asks where it lies, also where its modules are handed to it.
    define: {'import.meta.url': '"file:///"'},
  });
  const text = (ending) => built.outputFiles.find((file) => file.path.endsWith(ending))?.text ?? '';
  const wasm = (name) => deflateRawSync(readFileSync(join(enginePackage, name)), {level: 9}).toString('base64');
  const script = scriptText(text('.js')), style = text('.css');
  const parts = {
    'CAB-NOTICES': () => escapeHtml(notices(options, built.metafile.inputs)),
    'CAB-POLICY': () => policyOf(script, style),
    'CAB-STYLE': () => style,
    'CAB-WASM-SIMD': () => wasm('cab_simd.wasm'),
    'CAB-WASM-SCALAR': () => wasm('cab_scalar.wasm'),
    'CAB-SCRIPT': () => script,
  };
  const page = readFileSync(join(source, 'src/page.html'), 'utf8')
      .replace(/\{\{(CAB-[A-Z-]+)\}\}/g, (mark, name) => {
        if (!parts[name]) throw new Error(`page.html: ${mark} is not known`);
        return parts[name]();
      });
  if (page.split(DATA_LINE).length !== 2) throw new Error(`page.html must have one line ${DATA_LINE}`);
  const bytes = Buffer.byteLength(page);
  if (bytes > MOST_BYTES) throw new Error(`the page has ${bytes} bytes, more than ${MOST_BYTES}`);
  const file = join(work, 'cab_view.html');
  writeFileSync(file, page);
  console.log(`${file}: ${bytes} bytes`);
}

function buildPrograms({work, programs}, bundle) {
  for (const file of programs) {
    bundle({
      entryPoints: [linked(work, file)],
      outfile: join(work, 'programs', `${basename(file, '.ts')}.mjs`),
      platform: 'node',
      format: 'esm',
      sourcemap: 'inline',
      packages: 'bundle',
      external: ['puppeteer-core'],
    });
  }
}

function main() {
  const options = readOptions();
  mkdirSync(options.work, {recursive: true});
  installPackages(options.work);
  linkSources(options);
  generateFormat(options);
  checkTypes(options);
  const bundle = bundler(options.work);
  if (options.page) buildPage(options, bundle);
  buildPrograms(options, bundle);
}

try {
  main();
} catch (error) {
  // A program that failed has printed why.
  console.error(`build.mjs: ${error.message}`);
  process.exitCode = 1;
}
