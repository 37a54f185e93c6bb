// The report in a browser: from file://, without a network, by mouse and by keyboard. It needs Chromium, and the page
// in the folder of the build.
import assert from 'node:assert/strict';
import test, {after, before} from 'node:test';
import type {Page} from 'puppeteer-core';
import {readRecording} from '../../perf/view/src/recording/reader.js';
import type {Report, ReportInterval, ReportPair} from '../../perf/view/src/report/types.js';
import {hitAt, hitCount} from '../../perf/view/src/scene/hits.js';
import {type OpenPage, openPage, recordingElement} from './chromium.js';
import {fixture} from './fixture.js';

const RECORDING = 'avx512.cab';
const INTERVALS = 250;

/** The first hit of the recording that stands in the page. */
function firstHit(): {frame: number; pair: Pick<ReportPair, 'a' | 'b'>} {
  const recording = readRecording(fixture(RECORDING), RECORDING);
  for (let frame = 0; frame < recording.frameCount; ++frame) {
    const {hits} = recording.frame(frame);
    if (hitCount(hits) === 0) continue;
    const {slotA, instanceA, linkA, slotB, instanceB, linkB} = hitAt(hits, 0);
    return {frame, pair: {a: [slotA, instanceA, linkA], b: [slotB, instanceB, linkB]}};
  }
  throw new Error(`${RECORDING} has no hit`);
}

const HIT = firstHit();

/** Rows whose depths fall and whose frames rise in number. All but the second are of the embedded recording. */
function madeReport(): Report {
  const file = {
    title: '', frames: 400, frames_read: 400, seconds_per_frame: 0.01, metres_per_unit: 1, problems: [],
  };
  const intervals: ReportInterval[] = Array.from({length: INTERVALS}, (_, i) => ({
    file: i === 1 ? 1 : 0, ...HIT.pair, character_a: 'anna', link_a: `link ${i}`, character_b: '<b>ben</b>',
    link_b: 'hand', first: HIT.frame, last: HIT.frame + i, frames: i + 1, first_seconds: 1, last_seconds: 2,
    worst_depth: (1000 - i) / 10000, worst_triangles: null, worst_frame: HIT.frame, worst_seconds: 1, worst_point: null,
  }));
  const pairs: ReportPair[] = intervals.slice(0, 3).map((row, i) => ({
    ...row, a: [row.a[0], row.a[1], i], share: row.frames / 400, intervals: 1, longest: row.frames,
  }));
  return {
    version: '1', intervals, pairs, interval_count: 1000, pair_count: 3, min_depth: null, min_frames: 1,
    csv: 'report.csv',
    files: [{...file, name: 'takes/first.cab', recording: 0},
            {...file, name: 'takes/second.cab', recording: null, problems: ['frame 7 is left out']}],
  };
}

let opened: OpenPage;
let page: Page;

before(async () => {
  const json = JSON.stringify(madeReport()).replaceAll('<', '\\u003c');
  opened = await openPage(`<script type="application/json" id="cab-report">${json}</script>\n` +
      recordingElement('first.cab', fixture(RECORDING)));
  ({page} = opened);
});

after(() => opened?.close());

const SHOWN = '[role=tabpanel]:not([hidden])';

const texts = (selector: string): Promise<string[]> =>
  page.$$eval(selector, (found) => found.map((element) => element.textContent ?? ''));

const columnOf = (column: number): Promise<string[]> => texts(`${SHOWN} tbody td:nth-child(${column})`);

async function press(...keys: readonly Parameters<Page['keyboard']['press']>[0][]): Promise<void> {
  for (const key of keys) await page.keyboard.press(key);
}

const focused = (): Promise<string> => page.evaluate(() => document.activeElement?.getAttribute('aria-label') ?? '');

async function chooseTab(name: string): Promise<void> {
  for (const tab of await page.$$('.report [role=tab]'))
    if (await tab.evaluate((element) => element.textContent) === name) await tab.click();
}

test('events are shown first, over time, in two lines each, with a picture of the worst', async () => {
  assert.equal(await page.$eval('h1', (title) => title.textContent), 'Report');
  // All intervals of the first file begin at once, and the one of the second file is another event.
  assert.deepEqual(await texts(`${SHOWN} .event-depth`), ['100 mm', '99.9 mm']);
  assert.match((await texts(`${SHOWN} .event-time`))[0]!, /^at 1\.00 s, for 1\.00 s$/);
  assert.equal((await texts(`${SHOWN} .event-names`))[0], 'anna: link 0 \u2013 <b>ben</b>: hand');
  assert.equal(await page.$$eval(`${SHOWN} .report-event-strip`, (strips) => strips.length), 2);
  await page.waitForSelector(`${SHOWN} .report-worst img`, {visible: true});
  const drawn = await page.$eval(`${SHOWN} .report-worst img`, async (image) => {
    await (image as HTMLImageElement).decode();
    const canvas = Object.assign(document.createElement('canvas'), {width: 64, height: 36});
    const context = canvas.getContext('2d')!;
    context.drawImage(image as HTMLImageElement, 0, 0, 64, 36);
    return new Set(new Uint32Array(context.getImageData(0, 0, 64, 36).data.buffer)).size;
  });
  assert(drawn > 20, `the picture has ${drawn} colours`);
  assert.match((await texts(`${SHOWN} figcaption`))[0]!, /^The worst: 100 mm, anna: link 0/);
});

test('the report fits a narrow screen, two lines per row', async () => {
  await page.setViewport({width: 400, height: 800});
  for (const tab of ['Events', 'Intervals', 'Pairs']) {
    await chooseTab(tab);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 400, tab);
    const rows = `${SHOWN} ${tab === 'Events' ? 'li' : 'tbody tr'}`;
    const heights = await page.$$eval(rows, (all) => all.map((row) => row.getBoundingClientRect().height));
    assert(heights.every((height) => height > 30 && height < 62), `${tab}: ${heights.slice(0, 3)}`);
    const depth = await page.$eval(`${rows} ${tab === 'Events' ? '.event-depth' : 'td:nth-child(2)'}`,
                                   (cell) => [cell.getBoundingClientRect().left, cell.getBoundingClientRect().right]);
    assert(depth[0]! >= 0 && depth[0]! < 100 && depth[1]! < 400, `${depth}`);
  }
  await page.setViewport({width: 1280, height: 800});
});

test('the report is dark where the system is', async () => {
  const brightness = () => page.$eval('.report', (report) => {
    const numbers = (text: string) => (text.match(/[\d.]+/g) ?? []).slice(0, 3).map(Number);
    const {backgroundColor, color} = getComputedStyle(report);
    return [numbers(backgroundColor), numbers(color)].map((rgb) => rgb.reduce((sum, part) => sum + part, 0) / 3);
  });
  const [paper, ink] = await brightness();
  assert(paper! > 240 && ink! < 60);
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
  const [darkPaper, lightInk] = await brightness();
  assert(darkPaper! < 60 && lightInk! > 200);
  await page.emulateMediaFeatures([]);
});

test('intervals are shown, worst first, a hundred rows at a time', async () => {
  await chooseTab('Intervals');
  const links = await columnOf(6);
  assert.equal(links.length, 100);
  assert.deepEqual(links.slice(0, 3), ['link 0', 'link 1', 'link 2']);
  assert.equal((await columnOf(7))[0], '<b>ben</b>');
  assert.equal((await columnOf(2))[0], '100 mm');
  assert.match((await texts('.report header'))[0]!, /1 file could not be read in full/);
  assert.match((await texts('.report header'))[0]!, /250 of 1\u202f000 intervals are here; report\.csv has all/);
});

test('headers sort by keyboard, and say how', async () => {
  const header = 'th:nth-child(11)';
  await page.focus(`${SHOWN} ${header} button`);
  await press('Enter');
  assert.equal((await columnOf(6))[0], 'link 249');
  assert.equal(await page.$eval(`${SHOWN} ${header}`, (cell) => cell.getAttribute('aria-sort')), 'descending');
  await press('Enter');
  assert.equal((await columnOf(6))[0], 'link 0');
  assert.equal(await page.$eval(`${SHOWN} ${header}`, (cell) => cell.getAttribute('aria-sort')), 'ascending');
  await press('Enter');
  assert.equal(await page.$eval(`${SHOWN} ${header}`, (cell) => cell.getAttribute('aria-sort')), 'none');
});

test('arrows and pages walk through the rows', async () => {
  await page.focus(`${SHOWN} tbody button`);
  await press('ArrowDown', 'ArrowDown');
  assert.match(await focused(), /link 2 /);
  await press('PageDown');
  assert.match(await focused(), /link 100 /);
  await press('PageDown', 'End');
  assert.match(await focused(), /link 249 /);
  await press('PageUp', 'PageUp', 'ArrowUp');
  assert.match(await focused(), /link 0 /);
});

test('filters work as one types, and can be cleared', async () => {
  const [depth, frames] = await page.$$('.report form input[type=number]');
  await depth!.type('95');
  assert.equal((await columnOf(6)).length, 51);
  await frames!.type('41');
  assert.deepEqual((await columnOf(6)).length, 11);
  assert.match((await texts(`${SHOWN} .report-pages`))[0]!, /Rows 1 to 11 of 11 \(of 250 without filters\)/);
  await page.type('.report form input[type=search]', 'LINK 45');
  assert.deepEqual(await columnOf(6), ['link 45']);
  await page.click('.report form button[type=reset]');
  await page.waitForFunction((rows) => document.querySelectorAll(rows).length === 100, {}, `${SHOWN} tbody tr`);
});

test('what is not in the page says how to see it', async () => {
  const button = await page.$(`${SHOWN} tbody tr:nth-child(2) button`);
  assert.equal(await button!.evaluate((element) => element.getAttribute('aria-disabled')), 'true');
  assert.equal(await button!.evaluate((element) => element.title), 'Not in this page: cab view takes/second.cab');
  await button!.click();
  assert.equal(await page.evaluate(() => location.hash), '');
});

test('files with a problem come first, with all of it', async () => {
  await chooseTab('Files');
  assert.deepEqual(await columnOf(2), ['second.cab', 'first.cab']);
  assert.equal((await columnOf(6))[0], 'frame 7 is left out');
});

test('the matrix tells the numbers of the cell that has the focus', async () => {
  await chooseTab('Matrix');
  await page.focus(`${SHOWN} td button`);
  assert.match((await texts(`${SHOWN} .quiet`))[0]!, /anna: link 0 .* 1 frame \(0\.3 %\).* at worst 100 mm deep/);
  await press('ArrowDown');
  assert.match((await texts(`${SHOWN} .quiet`))[0]!, /anna: link 2 .* 3 frames/);
});

test('the matrix is as wide as the page, or its cells as wide as they get, and has a scale', async () => {
  const sizes = () => page.$eval(SHOWN, (panel) => {
    const widthOf = (what: string): number => panel.querySelector(what)!.getBoundingClientRect().width;
    const columns = panel.querySelectorAll('thead th').length;
    const over = document.documentElement.scrollWidth - innerWidth;
    return {page: widthOf('.report-scroll'), table: widthOf('table'), cell: widthOf('tbody td'), columns, over};
  });
  const wide = await sizes();
  assert(wide.cell > 48, JSON.stringify(wide));
  assert(Math.abs(wide.table - Math.min(wide.page, 180 + 96 * wide.columns)) < 2, JSON.stringify(wide));
  assert.match((await texts(`${SHOWN} .report-scale`))[0]!, /^none[0-9.]+ % of the frames$/);
  await page.select(`${SHOWN} select[aria-label="Colour by"]`, 'worst');
  assert.match((await texts(`${SHOWN} .report-scale`))[0]!, /^none[0-9.]+ mm$/);
  const {width, height} = page.viewport()!;
  await page.setViewport({width: 400, height});
  const narrow = await sizes();
  await page.setViewport({width, height});
  assert(narrow.cell >= 24 && narrow.over <= 0, JSON.stringify(narrow));
});

test('a row opens its recording at its frame with its pair, and the way back is the browser\'s', async () => {
  await chooseTab('Intervals');
  await page.focus(`${SHOWN} tbody button`);
  await press('Enter');
  await page.waitForSelector('.pairs .selected');
  assert.deepEqual(await page.evaluate(async () => {
    await window.cabPage.ready;
    return [window.cabPage.recording, window.cabPage.frame, window.cabPage.errors.length];
  }), [0, HIT.frame, 0]);
  const {a, b} = HIT.pair;
  const pair = `${a.join('.')}-${b.join('.')}`;
  assert.equal(await page.evaluate(() => location.hash), `#recording=0&frame=${HIT.frame}&pair=${pair}`);
  await page.goBack();
  await page.waitForSelector('.report', {visible: true});
});

test('nothing was asked of a network, and nothing went wrong', () => assert.deepEqual(opened.errors, []));
