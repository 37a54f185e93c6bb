// The page in a real browser: it opens from a file without network, plays, reruns frames to the same bits, takes keys,
// and says what is wrong with a recording.
//
//   node --test-reporter=spec browser.mjs --work DIR --browser PROGRAM
//       [--page FILE] [--recording FILE.cab ...] [--crowd FILE.cab] [--states FILE.cab] [--pictures DIR]
//       [--renew]
//
//   --work       the folder of --work of perf/view/build.mjs, for puppeteer-core and the page
//   --page       default: WORK/cab_view.html
//   --recording  more recordings to look at. avx512.cab beside this file is always one
//   --crowd      a recording whose pictures per second are printed; they are not judged
//   --states     a recording of random states of tests/engine/bindings/python/arm.urdf
//   --pictures   where pictures of the page are written. Default: WORK/pictures
//   --renew      writes the small pictures that others are compared with, tests/view/pictures/NAME.png
import assert from 'node:assert/strict';
import {existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {basename, join, resolve} from 'node:path';
import {after, before, describe, test} from 'node:test';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {parseArgs} from 'node:util';

const {values: options} = parseArgs({
  options: {
    work: {type: 'string'},
    browser: {type: 'string'},
    page: {type: 'string'},
    recording: {type: 'string', multiple: true, default: []},
    crowd: {type: 'string'},
    states: {type: 'string'},
    pictures: {type: 'string'},
    renew: {type: 'boolean', default: false},
  },
});
for (const name of ['work', 'browser']) assert(options[name], `--${name} is missing`);

const here = fileURLToPath(new URL('.', import.meta.url));
const work = resolve(options.work);
const pageFile = options.page ? resolve(options.page) : join(work, 'cab_view.html');
const pictures = options.pictures ? resolve(options.pictures) : join(work, 'pictures');
const fixtureFile = join(here, 'fixtures/avx512.cab');
const fixture = readFileSync(fixtureFile);
// Two tubes that bend: write_tube of tests/engine/bindings/python/test_surfaces.py with 12 frames, twice, by
// `cab run ... --offset 0,0,0 --offset 0.2,-0.1,0.3 --body surface --record skin.cab`.
const skinFile = join(here, 'fixtures/skin.cab');

const WIDTHS = {400: 800, 800: 1000, 1280: 800, 1920: 1080};
// Pictures are compared after they are made so small. Renderers draw edges and lines differently.
const SMALL = {width: 48, height: 30};
// Of the scene's background, as src/scene/colors.ts has it.
const BACKGROUND = [0x1c, 0x23, 0x2b, 0xff];
// How much of what stands in front of the background may be elsewhere: 0 nothing, 1 all. Two runs of one renderer
// differ by 0, the two people of the demo at another moment by 0.4.
const MOST_DIFFERENCE = 0.08;

const folder = mkdtempSync(join(tmpdir(), 'cab-browser-'));
let browser;

before(async () => {
  const puppeteer = createRequire(join(work, 'package.json'))('puppeteer-core');
  mkdirSync(pictures, {recursive: true});
  browser = await puppeteer.launch({
    executablePath: options.browser,
    headless: true,
    args: ['--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
           '--disable-background-networking', '--disable-component-update', '--disable-sync'],
  });
});

after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

const escapeHtml = (text) => text.replaceAll('&', '&amp;').replaceAll('"', '&quot;').replaceAll('<', '&lt;');

/** A page with recordings in it, as `cab view` writes them. */
function embed(name, recordings) {
  const page = readFileSync(pageFile, 'utf8');
  assert.equal(page.split('<!--CAB-DATA-->').length, 2, 'the page has one place for data');
  const data = Object.entries(recordings).map(([recording, bytes]) =>
    `<script type="application/octet-stream" class="cab-recording" data-name="${escapeHtml(recording)}">` +
    `${Buffer.from(bytes).toString('base64')}</script>`).join('\n');
  const file = join(folder, `${name}.html`);
  writeFileSync(file, page.replace('<!--CAB-DATA-->', () => data));
  return file;
}

/** Opens a page, and fails on whatever it asks of the network or prints as an error. */
async function open(file, {width = 1280, fragment = ''} = {}) {
  const tab = await browser.newPage();
  await tab.setViewport({width, height: WIDTHS[width]});
  const wrong = [];
  await tab.setRequestInterception(true);
  tab.on('request', (request) => {
    const isLocal = /^(file|data|blob):/.test(request.url());
    if (!isLocal) wrong.push(`request of ${request.url()}`);
    void (isLocal ? request.continue() : request.abort());
  });
  tab.on('console', (message) => {
    if (message.type() === 'error') wrong.push(`console: ${message.text()}`);
  });
  tab.on('pageerror', (error) => wrong.push(`error: ${error.message}`));
  await tab.goto(`${pathToFileURL(file).href}${fragment}`);
  await tab.evaluate('cabPage.ready.then(() => cabPage.engineReady)');
  /** Waits until what has changed is drawn, with its labels in their places: a flight has begun by the second frame. */
  const drawn = () => tab.evaluate(() => new Promise((done) => {
    requestAnimationFrame(() => requestAnimationFrame(done));
  }));
  return {
    tab,
    read: (member) => tab.evaluate(`cabPage.${member}`),
    /** Waits until an expression in the page is true. The page's policy lets nobody make a function of a text there. */
    async until(expression) {
      for (const begin = Date.now(); !await tab.evaluate(expression);) {
        assert(Date.now() - begin < 20000, `it never came to be: ${expression}`);
        await new Promise((done) => setTimeout(done, 20));
      }
    },
    drawn,
    /** Waits until the camera is where it flies to. Returns it. */
    async still() {
      for (let last = '';;) {
        await drawn();
        const now = JSON.stringify(await tab.evaluate('cabPage.camera'));
        if (now === last) return JSON.parse(now);
        last = now;
      }
    },
    /** The scene as an address of a PNG. */
    async picture() {
      await drawn();
      return `data:image/png;base64,${await (await tab.$('.surface')).screenshot({encoding: 'base64'})}`;
    },
    async close() {
      await tab.close();
      assert.deepEqual(wrong, []);
    },
  };
}

const text = (page, selector) => page.tab.$eval(selector, (element) => element.textContent);

async function showTab(page, title) {
  for (const tab of await page.tab.$$('[role="tab"]')) {
    if (await tab.evaluate((element) => element.textContent) === title) return tab.click();
  }
  throw new Error(`there is no tab ${title}`);
}

describe('the page', () => {
  test('without a recording asks for one, and opens a file', async () => {
    const page = await open(embed('empty', {}));
    assert.match(await text(page, '.start'), /Open a recording/);
    assert.equal(await page.read('frameCount'), 0);
    const input = await page.tab.$('input[type="file"]');
    await input.uploadFile(fixtureFile);
    await page.until('cabPage.frameCount > 0');
    assert.deepEqual(await page.read('errors'), []);
    await page.close();
  });

  test('opens recordings that it holds, and the place that the fragment names', async () => {
    const file = embed('two', {'first <&">.cab': fixture, 'second.cab': fixture});
    const page = await open(file, {fragment: '#recording=1&frame=2'});
    assert.equal(await page.read('recording'), 1);
    assert.equal(await page.read('frame'), 2);
    assert.deepEqual(await page.read('recordings'), ['first <&">.cab', 'second.cab']);
    await page.tab.select('select[aria-label="Recording"]', '0');
    await page.until('cabPage.recording === 0 && cabPage.frameCount > 0');
    await page.close();
  });

  test('runs no script but its own, and asks nothing of a network', async () => {
    const page = await open(embed('policy', {'a.cab': fixture}));
    const {ran, refused} = await page.tab.evaluate(async () => {
      const refused = new Set();
      document.addEventListener('securitypolicyviolation', ({effectiveDirective}) => refused.add(effectiveDirective));
      const script = Object.assign(document.createElement('script'), {textContent: 'window.ran = true'});
      const button = document.createElement('button');
      button.setAttribute('onclick', 'window.ran = true');
      const image = Object.assign(document.createElement('img'), {src: 'https://localhost/a.png'});
      document.body.append(script, button, image);
      button.click();
      await fetch('https://localhost/').catch(() => undefined);
      await new Promise((done) => setTimeout(done, 100));
      return {ran: window.ran === true, refused: [...refused].sort()};
    });
    assert.equal(ran, false);
    assert.deepEqual(refused, ['connect-src', 'img-src', 'script-src-attr', 'script-src-elem']);
    await page.tab.close();
  });

  test('and the npm package carry the licences of all that is in them', () => {
    const page = readFileSync(pageFile, 'utf8'), head = page.slice(0, page.indexOf('-->'));
    const packed = readFileSync(join(work, 'engine_package/LICENSE.third-party'), 'utf8');
    const parts = readFileSync(join(here, '../../cmake/LICENSE.third-party'), 'utf8').split('\n==== ').slice(1);
    let count = 0;
    for (const part of parts) {
      const words = /^In: (.*)$/m.exec(part)?.[1].split(' ') ?? [], title = `\n==== ${part.split('\n')[0]}\n`;
      if (words.includes('wasm')) assert(packed.includes(title), title);
      if (!words.includes('page') && !words.includes('wasm')) continue;
      assert(head.includes(title), title);
      ++count;
    }
    assert(count > 7);
    assert(head.includes('Redistribution and use in source and binary forms'));
  });

  test('names all of its controls', async () => {
    const page = await open(embed('names', {'a.cab': fixture}));
    const nameless = await page.tab.evaluate(() => {
      const nameOf = (element) => element.getAttribute('aria-label') || element.textContent.trim() || element.title ||
        [...element.labels ?? []].map((label) => label.textContent.trim()).join('');
      return [...document.querySelectorAll('button, select, input, [role="slider"], dialog')]
          .filter((element) => !nameOf(element)).map((element) => element.outerHTML.slice(0, 120));
    });
    assert.deepEqual(nameless, []);
    await page.close();
  });
});

describe('playing', () => {
  let page;
  before(async () => (page = await open(embed('play', {'avx512.cab': fixture}))));
  after(() => page.close());

  test('a click on the strip goes to its frame', async () => {
    const {x, y, width, height} = await (await page.tab.$('.timeline')).boundingBox();
    const frames = await page.read('frameCount');
    await page.tab.mouse.click(x + 0.5 * width, y + height / 3);
    assert.equal(await page.read('frame'), Math.floor(0.5 * frames));
    assert.equal(await page.tab.$eval('.timeline', (strip) => strip.getAttribute('aria-valuenow')),
                 String(await page.read('frame')));
    await page.tab.mouse.move(x + 0.5 * width, y + height / 3);
    await page.tab.mouse.down();
    await page.tab.mouse.move(x + 0.02 * width, y + height / 3, {steps: 4});
    await page.tab.mouse.up();
    assert.equal(await page.read('frame'), Math.floor(0.02 * frames));
  });

  test('it plays, and pauses', async () => {
    await page.tab.evaluate('cabPage.goTo(0)');
    await page.tab.click('button[aria-label^="Play"]');
    await page.until('cabPage.playing && cabPage.frame > 1');
    await page.tab.click('button[aria-label^="Pause"]');
    assert.equal(await page.read('playing'), false);
  });

  test('it jumps to contacts', async () => {
    await page.tab.evaluate('cabPage.goTo(0)');
    await page.tab.click('button[aria-label^="Next contact"]');
    assert(await page.read('frame') > 0);
    assert(await page.read('hits') > 0);
    await page.tab.evaluate('cabPage.goTo(cabPage.frameCount - 1)');
    await page.tab.click('button[aria-label^="Previous contact"]');
    assert(await page.read('hits') > 0);
  });

  test('a pair of links goes to its worst frame', async () => {
    await showTab(page, 'Contacts');
    await page.tab.click('.pairs button');
    assert(await page.read('hits') > 0);
    assert.equal(await page.tab.$$eval('.pairs .selected', (rows) => rows.length), 1);
    assert.match(await text(page, '.legend'), /selected pair/);
    const before = await page.read('frame');
    await page.tab.evaluate('cabPage.goTo(0)');
    const strip = await page.tab.$('.pairs .selected .pair-timeline');
    const {x, y, width, height} = await strip.boundingBox();
    await page.tab.mouse.click(x + width * (before + 0.5) / await page.read('frameCount'), y + height / 2);
    assert.equal(await page.read('frame'), before);
    await page.tab.type('input[type="search"]', 'no link is called this');
    assert.equal(await page.tab.$$eval('.pairs li', (rows) => rows.length), 0);
    await page.tab.$eval('input[type="search"]', (input) => {
      input.value = '';
      input.dispatchEvent(new Event('input'));
      input.blur();
    });
  });

  test('keys do what the help says', async () => {
    const {keyboard} = page.tab;
    const last = await page.read('frameCount') - 1;
    await page.tab.evaluate('document.activeElement.blur()');
    await keyboard.press('Escape');
    await keyboard.press('Home');
    assert.equal(await page.read('frame'), 0);
    await keyboard.press('ArrowRight');
    await keyboard.press('ArrowRight');
    await keyboard.press('ArrowLeft');
    assert.equal(await page.read('frame'), 1);
    await keyboard.press('End');
    assert.equal(await page.read('frame'), last);
    await keyboard.down('Shift');
    await keyboard.press('ArrowLeft');
    await keyboard.up('Shift');
    assert(await page.read('frame') < last);
    await keyboard.press('Space');
    assert.equal(await page.read('playing'), true);
    await keyboard.press('Space');
    assert.equal(await page.read('playing'), false);
    const callsBefore = (await page.read('drawn')).calls;
    await keyboard.press('b');
    await keyboard.press('2');
    await page.until(`cabPage.drawn.calls > ${callsBefore}`);
    assert.match(await text(page, '.legend'), /leaf boxes/);
    assert.equal(await page.tab.$eval('.view-controls select', (select) => select.value), '2');
    await keyboard.press('b');
    await keyboard.press('0');
    await keyboard.press('f');
    assert.equal(await page.tab.$$eval('.view-controls input:checked', (boxes) => boxes.length), 2);
    await keyboard.press('f');
    await keyboard.press('?');
    assert.equal(await page.tab.$$eval('dialog[open]', (dialogs) => dialogs.length), 1);
    await keyboard.press('Escape');
    assert.equal(await page.tab.$$eval('dialog[open]', (dialogs) => dialogs.length), 0);
  });

  test('a click selects a character', async () => {
    await page.tab.evaluate('cabPage.goTo(0)');
    await page.tab.keyboard.press('Escape');
    await page.tab.keyboard.press('z');
    await page.tab.evaluate('cabPage.select(0, 0)');
    await page.drawn();
    const name = await text(page, '.scene-label.selected');
    // The label is above and to the right of the place where the character is, by eight pixels.
    const place = await page.tab.evaluate(() => {
      const {left, bottom} = document.querySelector('.scene-label.selected').getBoundingClientRect();
      return {x: left - 8, y: bottom + 8};
    });
    await page.tab.keyboard.press('Escape');
    assert.equal(await page.tab.$$eval('.scene-label.selected', (labels) => labels.length), 0);
    await page.tab.mouse.click(place.x, place.y);
    await page.tab.waitForSelector('.scene-label.selected');
    assert.notEqual(name, '');
    await page.tab.keyboard.press('Escape');
  });
});

describe('a selected pair', () => {
  let page;
  before(async () => (page = await open(embed('pair', {'avx512.cab': fixture}))));
  after(() => page.close());

  test('is flown to, and away from again', async () => {
    const before = await page.still();
    await page.tab.click('.pairs button');
    const near = await page.still();
    assert(near.distance < before.distance / 2, `${near.distance} of ${before.distance}`);
    const moved = Math.hypot(...near.target.map((x, k) => x - before.target[k]));
    assert(moved > 0.01 * before.distance);
    await page.tab.click('.pairs li:nth-child(2) button');
    const other = await page.still();
    assert.notDeepEqual(other.target, near.target);
    await page.tab.keyboard.press('Escape');
    await page.tab.keyboard.press('z');
    const whole = await page.still();
    assert(whole.distance > 2 * near.distance);
  });

  test('is named with its depth and its time, and so is the worst one where none is selected', async () => {
    await page.tab.evaluate('cabPage.goTo(0)');
    await page.tab.click('.pairs button');
    assert.match(await text(page, '.contact-panel'), /^Selected, /);
    const name = await page.tab.$eval('.pairs .selected .pair-name', (element) => element.textContent);
    assert.equal(await text(page, '.contact-name'), name);
    assert.match(await text(page, '.contact-depth'), /^[\d.]+ (mm|m) deep$/);
    assert.match(await text(page, '.contact-panel'), /for one frame|for [\d.]+ s, \d+ frames/);
    await page.tab.keyboard.press('Escape');
    assert.match(await text(page, '.contact-panel'), /^Worst, /);
  });

  test('is in the address, which opens the same picture elsewhere', async () => {
    await page.tab.click('.pairs button');
    const frame = await page.read('frame');
    const hash = await page.tab.evaluate('location.hash');
    assert.match(hash, new RegExp(`^#recording=0&frame=${frame}&pair=[\\d.]+-[\\d.]+$`));
    const entries = await page.tab.evaluate('history.length');
    await page.tab.keyboard.press('ArrowLeft');
    assert.match(await page.tab.evaluate('location.hash'), new RegExp(`frame=${frame - 1}&pair=`));
    assert.equal(await page.tab.evaluate('history.length'), entries);
    const other = await open(embed('pair_again', {'avx512.cab': fixture}), {fragment: hash});
    assert.equal(await other.read('frame'), frame);
    await other.tab.waitForSelector('.pairs .selected');
    assert.equal(await other.tab.evaluate('location.hash'), hash);
    await other.close();
    await page.tab.keyboard.press('Escape');
    await page.tab.evaluate('cabPage.goTo(1)');
    assert.equal(await page.tab.evaluate('location.hash'), '#recording=0&frame=1');
  });

  test('is seen through what is around it: all else lets the background through', async () => {
    const brightness = async () => {
      const {bytes} = await smallPicture(page);
      return bytes.reduce((sum, value, i) => sum + Math.abs(value - BACKGROUND[i % 4]), 0);
    };
    await page.tab.click('.pairs button');
    await page.still();
    const through = await brightness();
    await page.tab.keyboard.press('Escape');
    const solid = await brightness();
    assert(through < 0.8 * solid, `${through}, and ${solid} where nothing is selected`);
  });

  test('pictures, films and markers are files', async () => {
    await page.tab.evaluate(() => {
      window.saved = [];
      const create = URL.createObjectURL;
      URL.createObjectURL = (blob) => {
        window.saved.push(blob);
        return create.call(URL, blob);
      };
      // The files are not written here.
      HTMLAnchorElement.prototype.click = function() { window.savedAs = this.download; };
    });
    const press = async (words) => {
      for (const button of await page.tab.$$('button')) {
        if (await button.evaluate((element) => element.textContent) === words) return button.click();
      }
      throw new Error(`there is no button ${words}`);
    };
    await press('Picture');
    await page.until('saved.length === 1');
    const picture = await page.tab.evaluate(async () => {
      const {width, height} = await createImageBitmap(window.saved[0]);
      return {width, height, type: window.saved[0].type, name: window.savedAs};
    });
    const {width, height} = await (await page.tab.$('.surface')).boundingBox();
    assert.deepEqual([picture.width, picture.height, picture.type],
                     [Math.round(width), Math.round(height), 'image/png']);
    assert.match(picture.name, /_\d+\.png$/);
    await press('Markers');
    const markers = await page.tab.evaluate(() => window.saved[1].text());
    const pairs = await page.tab.$$eval('.pairs li', (rows) => rows.length);
    assert(markers.trimEnd().split('\n').length > Math.min(pairs, 10));
    assert.match(markers, /^file,character_a,/);
    await page.tab.evaluate('cabPage.goTo(0)');
    await press('Film');
    await page.until('cabPage.playing && cabPage.frame > 2');
    await press('End film');
    await page.until('saved.length === 3');
    const film = await page.tab.evaluate(() => window.saved[2].arrayBuffer().then((bytes) =>
      [...new Uint8Array(bytes.slice(0, 4))]));
    assert.deepEqual(film, [0x1a, 0x45, 0xdf, 0xa3]);
    assert.equal(await page.read('playing'), false);
  });
});

describe('the theme', () => {
  test('is that of the system, also while the page is open', async () => {
    const page = await open(embed('theme', {'avx512.cab': fixture}));
    const colors = () => page.tab.evaluate(() => ['.side', '.top', '.bottom'].map((selector) => {
      const sum = (text) => text.match(/\d+/g).slice(0, 3).reduce((all, part) => all + Number(part), 0);
      const {backgroundColor, color} = getComputedStyle(document.querySelector(selector));
      return sum(color) - sum(backgroundColor);
    }));
    // The strip is drawn with the page's next picture.
    const strip = `document.querySelector('.timeline canvas').getContext('2d').getImageData(3, 3, 1, 1).data[0]`;
    assert((await colors()).every((difference) => difference < -400));
    await page.until(`${strip} > 200`);
    await page.tab.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
    assert((await colors()).every((difference) => difference > 400));
    await page.until(`${strip} < 80`);
    await page.close();
  });
});

describe('states of a robot', {skip: options.states ? false : 'no --states'}, () => {
  test('have no times, and words of the strip hide none of them', async () => {
    const page = await open(embed('states', {'arm.cab': readFileSync(options.states)}));
    assert.equal(await text(page, '.transport .time'), '');
    assert.match(await text(page, '.pairs li'), /[0-9] states \([0-9.]+ %\)/);
    // How many columns of the strip have a bar in the row below the words, and in the row of the words.
    const bars = (y) => page.tab.$eval('.timeline canvas', (canvas, row) => {
      const scale = canvas.height / canvas.clientHeight, {width} = canvas;
      const {data} = canvas.getContext('2d').getImageData(0, Math.round(row * scale), width, 1);
      return Array.from({length: width}, (_, x) => data[4 * x] > data[4 * x + 2] + 60).filter(Boolean).length;
    }, y);
    assert.equal(await bars(6), 0);
    assert(await bars(20) > 10);
    await page.close();
  });
});

describe('a skin', () => {
  let page;
  before(async () => {
    page = await open(embed('skin', {'skin.cab': readFileSync(skinFile)}), {fragment: '#frame=5&recording=0'});
  });
  after(() => page.close());

  // How many pixels of the scene are about as red as what touches.
  const redPixels = async () => {
    const picture = await page.picture();
    return page.tab.evaluate(async (source) => {
      const image = new Image();
      image.src = source;
      await image.decode();
      const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
      const context = canvas.getContext('2d', {willReadFrequently: true});
      context.drawImage(image, 0, 0);
      const {data} = context.getImageData(0, 0, image.width, image.height);
      let count = 0;
      for (let at = 0; at < data.length; at += 4) {
        if (data[at] > 120 && data[at] > 2 * data[at + 1] && data[at] > 2 * data[at + 2]) ++count;
      }
      return count;
    }, picture);
  };

  test('shows which triangles touch, and all of its links where boxes decide', async () => {
    assert.match(await text(page, '.legend'), /red: triangles that touch/);
    const triangles = await redPixels();
    assert(triangles > 50, `${triangles} pixels are red`);
    await page.tab.evaluate(`cabPage.setDial({exact: 'none'})`);
    const links = await redPixels();
    assert(links > 2 * triangles, `${links} pixels are red by links, ${triangles} by triangles`);
    await page.tab.evaluate('cabPage.setDial({})');
    assert.equal((await page.read('run')).sameBits, true);
    assert.deepEqual(await page.read('errors'), []);
  });

  test('is picked where it is, and not beside it', async () => {
    const {x, y, width, height} = await (await page.tab.$('.surface')).boundingBox();
    await page.tab.mouse.click(x + 4, y + height - 100);
    assert.equal(await page.tab.$$eval('.scene-label.selected', (labels) => labels.length), 0);
    let picked = 0, missed = 0;
    for (let row = 1; row < 10; ++row) {
      await page.tab.mouse.click(x + width / 2, y + height * row / 10);
      const labels = await page.tab.$$eval('.scene-label.selected', (all) => all.length);
      if (labels > 0) ++picked;
      else ++missed;
    }
    assert(picked > 0 && missed > 0, `${picked} picked, ${missed} missed`);
    await page.tab.keyboard.press('Escape');
  });
});

describe('the dial', () => {
  let page;
  before(async () => {
    page = await open(embed('dial', {'avx512.cab': fixture}));
    await showTab(page, 'The dial');
  });
  after(() => page.close());

  test('what AVX-512 recorded has the same bits here', async () => {
    await page.tab.evaluate('cabPage.jump(true)');
    await page.until('cabPage.run !== null');
    const run = await page.read('run');
    assert.equal(run.hash, await page.read('hash'));
    assert.equal(run.sameBits, true);
    assert.match(await text(page, '.dial-panel .verdict'), /Same bits in your browser/);
  });

  test('other settings are run beside the recorded ones', async () => {
    const select = (await page.tab.$$('.dial-fields select'))[0];
    for (const refit of ['covariance', 'aabb_hull']) {
      await select.select(refit);
      assert.deepEqual(await page.read('dial'), {refit});
      const run = await page.read('run');
      assert.equal(run.frame, await page.read('frame'));
      const cells = await page.tab.$$eval('.results tbody tr:last-child td',
                                          (all) => all.map((cell) => cell.textContent));
      assert.deepEqual(cells, [await page.read('hash'), run.hash]);
      assert.equal(await text(page, '.dial-panel .verdict'), run.text);
    }
    await page.tab.evaluate('cabPage.setDial({margin: 1000})');
    const run = await page.read('run');
    assert(run.hits > await page.read('hits'), 'a large margin finds more links');
    assert.equal(run.sameBits, false);
    assert.match(run.text, /the hash differs/);
    assert.match(await text(page, '.legend'), /Hits are those of the dial/);
    await page.tab.evaluate('cabPage.setDial({levelLeaves: 1})');
    assert.notEqual(await page.read('run'), null);
    const [reset] = await page.tab.$$('.dial-panel button');
    await reset.click();
    assert.equal((await page.read('run')).sameBits, true);
  });

  test('all frames have the same bits', async () => {
    for (const button of await page.tab.$$('.dial-panel button')) {
      if (await button.evaluate((element) => element.textContent) === 'Rerun all frames') await button.click();
    }
    await page.until('cabPage.rerun !== null');
    const rerun = await page.read('rerun');
    const frames = await page.read('frameCount');
    assert.equal(rerun.run, frames);
    assert.equal(rerun.same, frames);
    assert.match(rerun.text, new RegExp(`^${frames} of ${frames} frames: same bits in your browser`));
  });

  test('a frame that differs is named with its hit', async () => {
    await page.tab.evaluate('cabPage.setDial({margin: 1000})');
    const {firstDifferent, text: words} = await page.tab.evaluate('cabPage.rerunAll()');
    assert(firstDifferent >= 0);
    assert.match(words, new RegExp(`The first that differs is frame ${firstDifferent}: hit \\d+ was recorded as`));
    await page.tab.evaluate('cabPage.setDial({})');
  });
});

describe('a bad recording', () => {
  test('that is cut off plays as far as it goes, and says so', async () => {
    for (const share of [0.5, 0.8, 0.99]) {
      const page = await open(embed('cut', {'cut.cab': fixture.subarray(0, Math.floor(share * fixture.length))}));
      const errors = await page.read('errors');
      assert(errors.some((words) => /cut off|ends/.test(words)), errors.join('\n'));
      assert.match(await text(page, '.messages'), /cut off|ends/);
      await page.close();
    }
  });

  test('that is damaged, or none at all, says so', async () => {
    const damaged = Buffer.from(fixture);
    damaged.fill(0x55, Math.floor(0.7 * damaged.length), Math.floor(0.7 * damaged.length) + 64);
    const cases = {
      damaged, noise: Buffer.from('This is a letter, and no recording.'), empty: Buffer.alloc(0),
      head: fixture.subarray(0, 70),
    };
    for (const [name, bytes] of Object.entries(cases)) {
      const page = await open(embed('damaged', {[`${name}.cab`]: bytes}));
      assert((await page.read('errors')).length > 0, name);
      assert((await text(page, '.messages')).length > 20, name);
      await page.tab.evaluate('cabPage.goTo(cabPage.frameCount - 1)');
      await page.close();
    }
  });

  test('that the fragment names but the page lacks is told', async () => {
    const page = await open(embed('lacks', {'a.cab': fixture}), {fragment: '#recording=7'});
    assert.match(await text(page, '.messages'), /There is no recording 7/);
    await page.close();
  });
});

/** The scene, made small: RGBA bytes and a PNG of them. */
const smallPicture = async (page) => page.tab.evaluate(shrink, await page.picture(), SMALL);

// Runs in the page.
async function shrink(source, {width, height}) {
  const image = new Image();
  image.src = source;
  await image.decode();
  const canvas = Object.assign(document.createElement('canvas'), {width, height});
  const context = canvas.getContext('2d', {willReadFrequently: true});
  context.imageSmoothingQuality = 'high';
  context.drawImage(image, 0, 0, width, height);
  return {bytes: [...context.getImageData(0, 0, width, height).data], png: canvas.toDataURL('image/png')};
}

function differenceOf(a, b) {
  const distance = (p, q) => p.reduce((sum, value, i) => sum + Math.abs(value - q(i)), 0);
  const background = (i) => BACKGROUND[i % 4];
  return distance(a, (i) => b[i]) / (distance(a, background) + distance(b, background));
}

describe('pictures', () => {
  const recordings = [fixtureFile, skinFile, ...options.recording.map((file) => resolve(file))];
  for (const file of recordings) {
    const name = basename(file, '.cab');
    test(`of ${name} fit the page, and look as before`, async (t) => {
      for (const width of Object.keys(WIDTHS).map(Number)) {
        const page = await open(embed(name, {[basename(file)]: readFileSync(file)}), {width});
        await page.tab.evaluate('cabPage.jump(true)');
        await page.until('cabPage.run !== null');
        const wide = await page.tab.evaluate(() => ({
          page: document.documentElement.scrollWidth,
          panels: [...document.querySelectorAll('.side, .bottom, .top, .tabs > :not([hidden])')]
              .filter((element) => element.scrollWidth > element.clientWidth + 1).map((element) => element.className),
        }));
        assert(wide.page <= width, `the page is ${wide.page} wide of ${width}`);
        assert.deepEqual(wide.panels, []);
        await page.tab.screenshot({path: join(pictures, `${name}_${width}.png`)});
        if (width === 1280) await compare(page, name, t);
        await page.tab.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
        await page.tab.screenshot({path: join(pictures, `${name}_${width}_dark.png`)});
        await page.tab.click('.pairs button');
        await page.still();
        const labels = await page.tab.$$eval('.scene-label', (all) => all.map((label) => {
          const {left, right, top, bottom} = label.getBoundingClientRect();
          return [left, right, top, bottom];
        }).filter(([left, right]) => right > left));
        assert(labels.length >= 2, 'both links of a pair have a label');
        labels.forEach((a, i) => labels.slice(0, i).forEach((b) =>
          assert(a[0] >= b[1] || b[0] >= a[1] || a[2] >= b[3] || b[2] >= a[3], `labels overlap: ${a} and ${b}`)));
        await page.tab.screenshot({path: join(pictures, `${name}_${width}_pair.png`)});
        await page.close();
      }
    });
  }
});

async function compare(page, name, t) {
  const reference = join(here, 'pictures', `${name}.png`);
  const seen = await smallPicture(page);
  if (options.renew) writeFileSync(reference, Buffer.from(seen.png.split(',')[1], 'base64'));
  if (!existsSync(reference)) {
    t.diagnostic(`there is no ${reference} to compare with`);
    return;
  }
  const png = readFileSync(reference).toString('base64');
  const wanted = await page.tab.evaluate(shrink, `data:image/png;base64,${png}`, SMALL);
  const difference = differenceOf(seen.bytes, wanted.bytes);
  t.diagnostic(`differs from ${basename(reference)} by ${difference.toFixed(3)}`);
  assert(difference <= MOST_DIFFERENCE, `the picture of ${name} differs by ${difference.toFixed(3)}`);
}

test('pictures per second are printed', {skip: options.crowd ? false : 'no --crowd'}, async (t) => {
  const page = await open(embed('crowd', {'crowd.cab': readFileSync(options.crowd)}));
  await page.tab.evaluate('cabPage.play(4)');
  const seen = [];
  for (let second = 0; second < 6; ++second) {
    await new Promise((done) => setTimeout(done, 1000));
    seen.push(await page.read('framesPerSecond'));
  }
  const {calls, triangles} = await page.read('drawn');
  t.diagnostic(`${await page.read('title')}: ${seen.slice(1).map((rate) => rate.toFixed(1)).join(', ')} ` +
               `pictures per second, ${triangles} triangles in ${calls} calls`);
  await page.close();
});
