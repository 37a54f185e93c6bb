// What the page makes of a report: filters, orders, words and the matrix of links.
import assert from 'node:assert/strict';
import test from 'node:test';
import {fileRows, intervalColumns, pairColumns, sortRows} from '../../perf/view/src/report/columns.js';
import {eventsOf, framesOf, worstOf} from '../../perf/view/src/report/events.js';
import {whenOf} from '../../perf/view/src/report/events_view.js';
import {type Filter, filterIntervals, filterPairs, hasMetres, NO_FILTER} from '../../perf/view/src/report/filter.js';
import {characterPairs, heat, hottest, makeMatrix} from '../../perf/view/src/report/matrix_data.js';
import {pairText, readPair} from '../../perf/view/src/report/pair_text.js';
import {
  depthText, fileNames, momentText, notEmbeddedText, notesOf, pairSentence, severityText, shareText,
} from '../../perf/view/src/report/texts.js';
import type {LinkRef, Report, ReportFile, ReportInterval, ReportPair} from '../../perf/view/src/report/types.js';
import {Numbers} from './scene.js';

const NAMES = ['hips', 'arm', 'hand', 'head'] as const;

const fileOf = (given: Partial<ReportFile> = {}): ReportFile => ({
  name: 'takes/a.cab', title: '', recording: 0, frames: 100, frames_read: 100, seconds_per_frame: 0.01,
  metres_per_unit: 1, problems: [], ...given,
});

const linksOf = (a: LinkRef, b: LinkRef) => ({
  file: 0, a, b, character_a: `p${a[0]}`, character_b: `p${b[0]}`, link_a: NAMES[a[2]] ?? '', link_b: NAMES[b[2]] ?? '',
});

function intervalOf(first: number, last: number, depth: number | null, given: Partial<ReportInterval> = {}):
    ReportInterval {
  return {
    ...linksOf([1, 0, 0], [2, 0, 1]), first, last, frames: last - first + 1, first_seconds: first / 100,
    last_seconds: last / 100, worst_depth: depth, worst_triangles: null, worst_frame: first, worst_seconds: first / 100,
    worst_point: null, ...given,
  };
}

function pairOf(a: LinkRef, b: LinkRef, frames: number, depth: number | null, longest = frames): ReportPair {
  return {
    ...linksOf(a, b), frames, share: frames / 100, intervals: 2, longest, worst_depth: depth, worst_triangles: null,
    worst_frame: 5, worst_seconds: 0.05, worst_point: null,
  };
}

function reportOf(given: Partial<Report> = {}): Report {
  const {intervals = [], pairs = []} = given;
  return {
    version: '1', files: [fileOf()], interval_count: intervals.length, pair_count: pairs.length, min_depth: null,
    min_frames: 1, csv: 'report.csv', intervals, pairs, ...given,
  };
}

const filterOf = (given: Partial<Filter>): Filter => ({...NO_FILTER, ...given});

test('filters take what is deep and long enough, of a file, with all words of any name', () => {
  const deep = intervalOf(0, 0, 0.5);
  const long = intervalOf(10, 19, 0.1, {file: 1, link_a: 'Left Foot'});
  const unknown = intervalOf(30, 34, null);
  const files = [fileOf(), fileOf({name: 'b.cab', title: 'Salsa'})];
  const report = reportOf({files, intervals: [deep, long, unknown]});
  const found = (given: Partial<Filter>) => filterIntervals(report, filterOf(given));
  assert.deepEqual(found({}), [deep, long, unknown]);
  assert.deepEqual(found({minDepth: 0.1}), [deep, long]);
  assert.deepEqual(found({minDepth: 0.2}), [deep]);
  assert.deepEqual(found({minDepth: 0}), [deep, long]);
  assert.deepEqual(found({minFrames: 5}), [long, unknown]);
  assert.deepEqual(found({minFrames: 6, minDepth: 0.2}), []);
  assert.deepEqual(found({file: 1}), [long]);
  assert.deepEqual(found({text: ' foot  LEFT '}), [long]);
  assert.deepEqual(found({text: 'salsa'}), [long]);
  assert.deepEqual(found({text: 'p2 arm hips'}), [deep, unknown]);
  assert.deepEqual(found({text: 'elbow'}), []);
});

test('a pair passes by its deepest contact and its longest interval', () => {
  const often = pairOf([1, 0, 0], [2, 0, 1], 50, 0.2, 3);
  const once = pairOf([1, 0, 0], [2, 0, 2], 4, 0.1, 4);
  const report = reportOf({pairs: [often, once]});
  assert.deepEqual(filterPairs(report, filterOf({minFrames: 4})), [once]);
  assert.deepEqual(filterPairs(report, filterOf({minDepth: 0.15})), [often]);
});

test('depths are in metres unless a file that was read does not know its unit', () => {
  assert.equal(hasMetres(reportOf()), true);
  assert.equal(hasMetres(reportOf({files: [fileOf(), fileOf({metres_per_unit: 0})]})), false);
  assert.equal(hasMetres(reportOf({files: [fileOf(), fileOf({metres_per_unit: 0, frames_read: 0})]})), true);
});

test('rows sort by every column, keep their order where equal, and have no depth last', () => {
  const rows = [intervalOf(5, 9, 0.1), intervalOf(1, 2, null), intervalOf(3, 7, 0.3, {link_a: 'arm 10'}),
                intervalOf(0, 4, 0.2, {link_a: 'arm 9'})];
  const columns = intervalColumns(reportOf({intervals: rows}), ['a.cab']);
  const order = (title: string, ascends: boolean) =>
    sortRows(rows, columns.find((column) => column.title === title)!, ascends).map((row) => rows.indexOf(row));
  assert.deepEqual(order('Worst depth', false), [2, 3, 0, 1]);
  assert.deepEqual(order('Worst depth', true), [0, 3, 2, 1]);
  assert.deepEqual(order('Frames', false), [0, 2, 3, 1]);
  assert.deepEqual(order('Frames', true), [1, 0, 2, 3]);
  assert.deepEqual(order('First', true), [3, 1, 2, 0]);
  assert.deepEqual(order('Link', true), [3, 2, 0, 1]);
  assert.equal(columns.some((column) => column.title === 'File'), false);
  assert.deepEqual(intervalColumns(reportOf(), ['a', 'b']).map(({title}) => title).slice(0, 3),
                   ['Worst depth', 'At', 'File']);
  for (const column of [...columns, ...pairColumns(reportOf(), ['a'])]) assert.notEqual(column.meaning, '');
});

test('triangles and places have columns where there are some, and depths where there are none of both', () => {
  const titles = (rows: ReportInterval[]) =>
    intervalColumns(reportOf({intervals: rows}), ['a.cab']).map(({title}) => title)
        .filter((title) => ['Worst depth', 'Triangles', 'At', 'Place'].includes(title));
  const skin = intervalOf(0, 4, null, {worst_triangles: 1234, worst_point: [1, -0.5, 0.005]});
  assert.deepEqual(titles([intervalOf(0, 4, 0.1)]), ['Worst depth', 'At']);
  assert.deepEqual(titles([intervalOf(0, 4, null)]), ['Worst depth', 'At']);
  assert.deepEqual(titles([skin]), ['Triangles', 'At', 'Place']);
  assert.deepEqual(titles([skin, intervalOf(0, 4, 0.1)]), ['Worst depth', 'Triangles', 'At', 'Place']);
  const columns = intervalColumns(reportOf({intervals: [skin]}), ['a.cab']);
  const [triangles, place] = ['Triangles', 'Place'].map((wanted) => columns.find(({title}) => title === wanted));
  assert.equal(triangles!.text(skin), '1\u202f234');
  assert.equal(triangles!.text(intervalOf(0, 4, 0.1)), '\u2013');
  assert.equal(place!.text(skin), '1.00, -0.50, 0.01 m');
  assert.equal(place!.text(intervalOf(0, 4, 0.1)), '\u2013');
  assert.equal(severityText(skin, fileOf()), '1\u202f234 triangles');
  assert.equal(severityText(intervalOf(0, 4, 0.1), fileOf()), '100 mm');
  const pair: ReportPair = {...pairOf([1, 0, 0], [2, 0, 2], 1, null), worst_triangles: 1};
  assert.match(pairSentence(pair, fileOf()), /, at worst 1 triangle in frame 5$/);
});

test('an event is the time in which two characters touch, by whichever links', () => {
  const other = {b: [2, 0, 2] as const, link_b: 'hand'};
  const deep = intervalOf(10, 14, 0.5), beside = intervalOf(12, 20, 0.2, other), behind = intervalOf(21, 22, 0.1);
  const later = intervalOf(24, 30, 0.4, other), third = intervalOf(12, 13, 0.05, {b: [3, 0, 1]});
  const intervals = [deep, later, beside, behind, third];
  const events = eventsOf(reportOf({intervals}), intervals);
  assert.deepEqual(events.map(({intervals: own}) => own), [[deep, beside, behind], [later], [third]]);
  assert.deepEqual(events.map(({first, last, pairs}) => [first, last, pairs]), [[10, 22, 2], [24, 30, 1], [12, 13, 1]]);
  assert.deepEqual(events.map(framesOf), [13, 7, 2]);
  assert.equal(whenOf(events[0]!, false, 100), 'at 0.10 s, for 0.12 s');
  assert.equal(whenOf({...events[2]!, firstSeconds: null}, false, 100), 'at 0.12 s, for 2 frames');
  assert.deepEqual(eventsOf(reportOf(), []), []);
});

test('random intervals are in one event each, and no two events of the same characters meet', () => {
  const numbers = new Numbers(11);
  for (let round = 0; round < 200; ++round) {
    const intervals = Array.from({length: 1 + numbers.below(30)}, () => {
      const first = numbers.below(120);
      return intervalOf(first, first + numbers.below(12), numbers.next(),
                        {b: [2, numbers.below(2), numbers.below(3)], file: numbers.below(2)});
    });
    const events = eventsOf(reportOf({files: [fileOf(), fileOf()], intervals}), intervals);
    assert.deepEqual(new Set(events.flatMap(({intervals: own}) => own)), new Set(intervals));
    assert.equal(events.reduce((sum, {intervals: own}) => sum + own.length, 0), intervals.length);
    for (const event of events) {
      const frames = new Set(event.intervals.flatMap(({first, last}) =>
        Array.from({length: last - first + 1}, (_, i) => first + i)));
      assert.equal(framesOf(event), frames.size);
      assert.equal(frames.size, event.last - event.first + 1, 'an event has no gap');
      for (const other of events) {
        const [own, its] = [worstOf(event), worstOf(other)];
        if (other === event || own.file !== its.file || own.b[1] !== its.b[1]) continue;
        assert(other.first > event.last + 1 || event.first > other.last + 1);
      }
    }
  }
});

test('states are no frames of a motion: each pair of links is an event, with the states in which it touches', () => {
  const intervals = [
    intervalOf(7, 7, 0.5), intervalOf(1, 2, 0.3, {b: [2, 0, 2], link_b: 'hand'}), intervalOf(9, 11, 0.1),
  ];
  const report = reportOf({files: [fileOf({seconds_per_frame: 0})], intervals});
  const events = eventsOf(report, intervals);
  assert.deepEqual(events.map(({intervals: own}) => own), [[intervals[0], intervals[2]], [intervals[1]]]);
  assert.equal(whenOf(events[0]!, true, 100), 'in 4 states (4.0 %), worst in state 7');
  const titles = (columns: readonly {title: string}[]) => columns.map(({title}) => title);
  assert(titles(pairColumns(report, ['a.cab'])).includes('States'));
  assert(!titles(pairColumns(report, ['a.cab'])).includes('Longest'));
  assert.deepEqual(titles(intervalColumns(report, ['a.cab'])).slice(0, 2), ['Worst depth', 'State']);
});

test('files with problems come first', () => {
  const files = [fileOf({name: 'a'}), fileOf({name: 'b', problems: ['cut off']}), fileOf({name: 'c'})];
  const worst = intervalOf(0, 1, 1, {file: 2});
  const rows = fileRows(reportOf({files, intervals: [worst, intervalOf(5, 6, 0.5, {file: 2})]}), fileNames(files));
  assert.deepEqual(rows.map(({name}) => name), ['b', 'a', 'c']);
  assert.equal(rows[2]!.worst, worst);
  assert.equal(rows[1]!.worst, undefined);
});

test('a pair in the fragment comes back, and what is none does not', () => {
  const pair = {a: [1, 20, 3], b: [4, 0, 66]} as const;
  assert.equal(pairText(pair), '1.20.3-4.0.66');
  assert.deepEqual(readPair(pairText(pair)), pair);
  for (const text of ['', '1.2.3', '1.2.3-4.5', '1.2.3-4.5.6-', '-1.2.3-4.5.6', '1.2.3-4.5.x', ' 1.2.3-4.5.6'])
    assert.equal(readPair(text), null, text);
});

test('numbers in words', () => {
  assert.equal(depthText(0.01234, fileOf()), '12.3 mm');
  assert.equal(depthText(-0.01234, fileOf()), '12.3 mm apart');
  assert.equal(depthText(0.01234, fileOf({metres_per_unit: 0})), '0.0123');
  assert.equal(depthText(null, fileOf()), '\u2013');
  assert.equal(momentText(1234, 5.678), '1\u202f234 (5.68 s)');
  assert.equal(momentText(7, null), '7');
  assert.equal(shareText(0), '0 %');
  assert.equal(shareText(0.0005), 'under 0.1 %');
  assert.equal(shareText(0.1234), '12.3 %');
  assert.equal(shareText(1), '100 %');
  assert.equal(pairSentence(pairOf([1, 0, 0], [2, 0, 2], 4, 0.1), fileOf()),
               'p1: hips \u2013 p2: hand: 4 frames (4.0 %) in 2 intervals, at worst 100 mm deep in frame 5');
  assert.equal(pairSentence(pairOf([1, 0, 0], [2, 0, 2], 1, null), fileOf()),
               'p1: hips \u2013 p2: hand: 1 frame (1.0 %) in 2 intervals');
  assert.deepEqual(fileNames([fileOf({name: 'x/a.cab'}), fileOf({name: 'y/a.cab'}), fileOf({name: 'y\\b.cab'})]),
                   ['x/a.cab', 'y/a.cab', 'b.cab']);
  assert.equal(notEmbeddedText(fileOf({recording: null})), 'Not in this page: cab view takes/a.cab');
});

test('the page says what it leaves out', () => {
  assert.deepEqual(notesOf(reportOf({intervals: [intervalOf(0, 1, 1)]})), []);
  const notes = notesOf(reportOf({interval_count: 30, pair_count: 20, min_depth: 0.002, min_frames: 3}));
  assert.equal(notes.length, 4);
  assert.match(notes[0]!, /2\.00 mm/);
  assert.match(notesOf(reportOf({min_depth: 2, files: [fileOf({metres_per_unit: 0})]}))[0]!, / 2\.00 deep/);
  assert.match(notes[2]!, /0 of 30 intervals.*report\.csv/);
});

test('the matrix has the links that touch, in the order of the skeleton', () => {
  const pairs = [pairOf([1, 0, 2], [2, 0, 3], 9, 0.4), pairOf([1, 0, 0], [2, 0, 3], 3, 0.1),
                 pairOf([1, 0, 0], [2, 0, 1], 1, null), pairOf([1, 1, 0], [2, 0, 1], 1, 0.2)];
  const characters = characterPairs(pairs);
  assert.deepEqual(characters.map((entry) => entry.pairs.length), [3, 1]);
  const matrix = makeMatrix(characters[0]!, 80);
  assert.deepEqual(matrix.rows, ['hips', 'hand']);
  assert.deepEqual(matrix.columns, ['arm', 'head']);
  assert.deepEqual(matrix.cells, [pairs[2], pairs[1], null, pairs[0]]);
  assert.equal(matrix.leftOut, 0);
  const small = makeMatrix(characters[0]!, 1);
  assert.deepEqual([small.rows, small.columns, small.cells], [['hand'], ['head'], [pairs[0]]]);
  assert.equal(small.leftOut, 2);
});

test('the matrix of one character has every pair on both sides', () => {
  const pairs = [pairOf([1, 0, 1], [1, 0, 3], 9, 0.4), pairOf([1, 0, 1], [1, 0, 2], 9, 0.4)];
  const {rows, columns, cells} = makeMatrix(characterPairs(pairs)[0]!, 80);
  assert.deepEqual(rows, ['arm', 'hand', 'head']);
  assert.deepEqual(columns, rows);
  assert.deepEqual(cells, [null, pairs[1], pairs[0], pairs[1], null, null, pairs[0], null, null]);
});

test('heat goes from 0 to 1, and is unknown without a depth', () => {
  const pairs = [pairOf([1, 0, 0], [2, 0, 0], 50, null), pairOf([1, 0, 0], [2, 0, 1], 25, 0.2),
                 pairOf([1, 0, 0], [2, 0, 2], 1, -0.1)];
  const byShare = hottest(pairs, 'share');
  const byDepth = hottest(pairs, 'worst');
  assert.deepEqual([byShare, byDepth], [pairs[0], pairs[1]]);
  assert.deepEqual(pairs.map((pair) => heat(pair, 'share', byShare)), [1, 0.5, 0.02]);
  assert.deepEqual(pairs.map((pair) => heat(pair, 'worst', byDepth)), [null, 1, 0]);
  assert.equal(heat(pairs[2]!, 'worst', pairs[2]), 0);
  assert.equal(hottest([pairs[0]!], 'worst'), undefined);
  assert.equal(heat(pairs[0]!, 'worst', undefined), null);
});
