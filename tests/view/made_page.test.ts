// A made recording in a browser: what the page says and draws of it.
import assert from 'node:assert/strict';
import test, {after, before} from 'node:test';
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

let opened: OpenPage;
before(async () => {
  const file = fileOf([chunkOfContents({...DEFINITIONS, frames: [APART]})]);
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

test('nothing went wrong, and nothing was asked of a network', () => assert.deepEqual(opened.errors, []));
