// Takes the pictures of docs/gallery.md, README.md and the first pages from the page, in a browser.
//
//   node gallery.mjs --work DIR --browser PROGRAM --pages DIR --out DIR
//
//   --work   the folder of --work of build.mjs, for puppeteer-core
//   --pages  NAME.html of each picture below, as `cab view NAME.cab` writes it; one that is not there is left out
//   --out    where NAME.png, and the frames FILM-NNN.png of the film, are written
import {existsSync, mkdirSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';
import {parseArgs} from 'node:util';

const {values: options} = parseArgs({
  options: {
    work: {type: 'string'},
    browser: {type: 'string'},
    pages: {type: 'string'},
    out: {type: 'string'},
  },
});
for (const name of ['work', 'browser', 'pages', 'out']) {
  if (options[name] === undefined) throw new Error(`--${name} is missing`);
}

// What each picture shows: the frame, keys that are pressed, and how the camera goes. `wheel` is in pixels, below 0
// nearer; `drag` in pixels. pair: the first pair of the list is selected, and flown to. contact: the next frame with a
// contact. whole: the page with its panels. report: the page of a report.
const PICTURES = [
  {name: 'viewer', of: 'people', frame: 1664, keys: [], pair: true, wheel: 300, whole: true},
  {name: 'viewer_dark', of: 'people', frame: 1664, keys: [], pair: true, wheel: 300, whole: true, dark: true},
  {name: 'viewer_400', of: 'people', frame: 1664, keys: [], pair: true, whole: true, width: 400, height: 860},
  {
    name: 'viewer_dark_400', of: 'people', frame: 1664, keys: [], pair: true, whole: true, dark: true, width: 400,
    height: 860,
  },
  {name: 'people', of: 'people', frame: 1664, keys: ['b', 'Escape'], pair: true, wheel: 700},
  {name: 'dancers', of: 'dancers', frame: 605, keys: ['5'], wheel: -400},
  {name: 'skin', of: 'skin', frame: 22, keys: [], wheel: -300},
  {name: 'report', of: 'report', report: true, whole: true, height: 620},
  {name: 'report_dark', of: 'report', report: true, whole: true, height: 620, dark: true},
  {name: 'report_400', of: 'report', report: true, whole: true, width: 400, height: 860},
  {name: 'report_dark_400', of: 'report', report: true, whole: true, dark: true, width: 400, height: 860},
  {name: 'rope', of: 'rope', frame: 10, keys: ['8', 'Escape'], pair: true, wheel: 200},
  {name: 'crowd', of: 'crowd', frame: 10, keys: [], wheel: -900, drag: [60, 20]},
  {name: 'dented', of: 'dented', frame: 520, keys: ['b', 'p'], wheel: -600},
  {name: 'arm', of: 'arm', frame: 0, keys: [], pair: true, whole: true, height: 560},
  {name: 'robot', of: 'robot', frame: 0, keys: ['b'], contact: true, wheel: -300},
];
const FILM = {
  of: 'people', first: 1560, last: 1760, step: 8, keys: ['Escape'], pair: true, wheel: 900, scale: .6,
};

const out = resolve(options.out);
const puppeteer = createRequire(join(resolve(options.work), 'package.json'))('puppeteer-core');
mkdirSync(out, {recursive: true});

// The address of the page with one recording; null if there is none.
function addressOf(name) {
  const file = join(resolve(options.pages), `${name}.html`);
  return existsSync(file) ? pathToFileURL(file).href : null;
}

async function open(browser, address, frame, {width = 1280, height = 800, scale = 1, dark, report} = {}) {
  const page = await browser.newPage();
  await page.setViewport({width, height, deviceScaleFactor: scale});
  if (dark) await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
  await page.goto(report ? address : `${address}#recording=0&frame=${frame}`);
  if (report) await page.waitForSelector('.report-worst img', {visible: true});
  await page.evaluate(async () => {
    await window.cabPage.ready;
    await window.cabPage.engineReady;
  });
  return page;
}

async function aim(page, {wheel = 0, drag, keys = [], pair = false, contact = false}) {
  const stage = await page.$('canvas');
  const box = await stage.boundingBox();
  const x = box.x + box.width / 2, y = box.y + box.height / 2;
  if (pair) {
    await page.click('.pair-name');
    await settled(page);
    await settled(page);
  }
  if (contact) await page.evaluate(() => window.cabPage.jump(true));
  for (const key of keys) await page.keyboard.press(key);
  await page.mouse.move(x, y);
  for (let left = Math.abs(wheel); left > 0; left -= 100) await page.mouse.wheel({deltaY: 100 * Math.sign(wheel)});
  if (drag) {
    await page.mouse.down();
    await page.mouse.move(x + drag[0], y + drag[1], {steps: 8});
    await page.mouse.up();
  }
  await page.mouse.move(box.x + 2, box.y + 2);
  await settled(page);
  return stage;
}

// Until two pictures have been drawn with all that was asked for.
const settled = (page) => page.evaluate(
    () => new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 400)));

const browser = await puppeteer.launch({
  executablePath: options.browser,
  headless: true,
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
try {
  for (const picture of PICTURES) {
    const address = addressOf(picture.of);
    if (address === null) {
      console.log(`${picture.name}: left out, there is no ${picture.of}.html`);
      continue;
    }
    const page = await open(browser, address, picture.frame, picture);
    const stage = picture.report ? page : await aim(page, picture);
    await (picture.whole ? page : stage).screenshot({path: join(out, `${picture.name}.png`)});
    await page.close();
  }
  const address = addressOf(FILM.of);
  if (address !== null) {
    const page = await open(browser, address, FILM.first, FILM);
    await page.evaluate((frame) => window.cabPage.goTo(frame), FILM.first);
    const stage = await aim(page, FILM);
    for (let frame = FILM.first, k = 0; frame < FILM.last; frame += FILM.step, ++k) {
      await page.evaluate((to) => window.cabPage.goTo(to), frame);
      await settled(page);
      await stage.screenshot({path: join(out, `film-${String(k).padStart(3, '0')}.png`)});
    }
  }
} finally {
  await browser.close();
}
