// A made recording in a browser: what the page says and draws of it.
import assert from 'node:assert/strict';
import test, {after, before} from 'node:test';
import {COLORS} from '../../perf/view/src/scene/colors.js';
import {type OpenPage, openPage, recordingElement} from './chromium.js';
import {DEFINITIONS, frameOf, inputOf, posesOf, SETTINGS} from './scene.js';
import {chunkOfContents, fileOf, type WrittenFrame} from './write_recording.js';

// Both crates beside each other, and one beside the floor, within a margin of half a metre.
const APART: WrittenFrame = {
  ...frameOf(0),
  settings: {...SETTINGS, margin: 1, rules: [{a: 1, b: 1, pairing: 'between'}, {a: 1, b: 2, pairing: 'between'}]},
  inputs: [inputOf(1, {poses: posesOf([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1.25, 0, 0])}), inputOf(2)],
  hits: Uint32Array.from([1, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 0]),
  contacts: Float32Array.from([1, 0, 0, -0.25, 0.5, 0, 0, 0.75, 0, 0, 0, 0, 0, -1, -0.5, 0, 0, 0, 0, 0, -0.5, 0]),
};

// Of the floor the half space alone takes part, and none of its triangles.
const WITHOUT_TRIANGLES: WrittenFrame =
    {...APART, index: 1, inputs: [APART.inputs[0]!, inputOf(2, {instances: new Uint32Array([0])})]};

let opened: OpenPage;
before(async () => {
  const file = fileOf([chunkOfContents({...DEFINITIONS, frames: [APART, WITHOUT_TRIANGLES]})]);
  opened = await openPage(recordingElement('made.cab', file));
  await opened.page.evaluate(() => window.cabPage.ready);
});
after(() => opened?.close());

const texts = (selector: string): Promise<string[]> =>
  opened.page.$$eval(selector, (found) => found.map((element) => element.textContent ?? ''));

test('links within the margin are apart, and are not said to touch', async () => {
  const depths = (await texts('.pairs .quiet')).map((words) => words.split(', ')[1]);
  assert.deepEqual(depths, ['125 mm apart', '250 mm apart']);
  assert.deepEqual(await texts('.contact-depth'), ['125 mm apart']);
  assert.match((await texts('.contact-panel'))[0]!, /1 more pair is within the margin$/);
});

// How many pixels of the scene have the hue and the brightness of static bodies.
async function staticPixels(): Promise<number> {
  // What has changed is drawn by the second frame.
  await opened.page.evaluate(() => new Promise((done) => {
    requestAnimationFrame(() => requestAnimationFrame(done));
  }));
  const png = await (await opened.page.$('.surface'))!.screenshot({encoding: 'base64'});
  return opened.page.evaluate(async (source, rgb) => {
    const image = new Image();
    image.src = source;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
    const context = canvas.getContext('2d')!;
    context.drawImage(image, 0, 0);
    const {data} = context.getImageData(0, 0, image.width, image.height);
    const [r, g, b] = [rgb >> 16, (rgb >> 8) & 255, rgb & 255] as [number, number, number];
    let found = 0;
    for (let at = 0; at < data.length; at += 4) {
      const share = data[at]! / r;
      if (share > 0.6 && Math.abs(data[at + 1]! / g - share) < 0.02 && Math.abs(data[at + 2]! / b - share) < 0.02)
        ++found;
    }
    return found;
  }, `data:image/png;base64,${png}`, COLORS.statics);
}

test('static triangles that take no part are not drawn', async () => {
  const all = await staticPixels();
  await opened.page.evaluate('cabPage.goTo(1)');
  const without = await staticPixels();
  assert(all > 200 && without < 0.1 * all, `${all} pixels, and ${without} without triangles`);
});

test('nothing went wrong, and nothing was asked of a network', () => assert.deepEqual(opened.errors, []));
