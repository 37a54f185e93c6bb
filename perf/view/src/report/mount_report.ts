// Shows a report: its filters, and what passes them as tables of intervals, pairs and files and as a matrix of links.
import './report.css';

import {el} from '../ui/dom.js';
import {plural} from '../ui/format.js';
import {makeTabs} from '../ui/tabs.js';
import {fileColumns, type FileRow, fileRows, intervalColumns, pairColumns} from './columns.js';
import {hasStatesAlone} from './events.js';
import {EventsView} from './events_view.js';
import {filterIntervals, filterPairs} from './filter.js';
import {FilterBar} from './filter_bar.js';
import {MatrixView} from './matrix_view.js';
import {pairText} from './pair_text.js';
import {RowTable} from './row_table.js';
import {makeStrip} from './strip.js';
import {fileNames, notEmbeddedText, notesOf, pairTitle} from './texts.js';
import type {OpenRecording, PictureOfRecording, Report, ReportInterval, Row} from './types.js';

const framesOf = (report: Report, row: Row): number => report.files[row.file]?.frames ?? 0;

/** The intervals of each pair, as far as the page has them. */
function intervalsByPair(report: Report): (row: Row) => readonly ReportInterval[] {
  const idOf = (row: Row): string => `${row.file}:${pairText(row)}`;
  const found = new Map<string, ReportInterval[]>();
  for (const interval of report.intervals) {
    const known = found.get(idOf(interval));
    if (known) known.push(interval);
    else found.set(idOf(interval), [interval]);
  }
  return (row) => found.get(idOf(row)) ?? [];
}

// What opening a row does, or why it does nothing.
function openableRow(report: Report, row: Row): {words: string} | {reason: string} {
  const file = report.files[row.file];
  if (!file || file.recording === null) return {reason: file ? notEmbeddedText(file) : 'It has no file'};
  return {words: `Open frame ${row.worst_frame} of ${pairTitle(row)}`};
}

function openRow(report: Report, row: Row, open: OpenRecording): void {
  const recording = report.files[row.file]?.recording;
  if (recording !== null && recording !== undefined) open(recording, row.worst_frame, row);
}

function heading(report: Report): HTMLElement {
  const bad = report.files.filter(({problems}) => problems.length > 0).length;
  const outside = report.files.filter(({recording, frames}) => recording === null && frames > 0);
  const notes = notesOf(report);
  if (outside.length > 0)
    notes.push(`Not in this page: ${outside.length} of ${plural(report.files.length, 'file')}; see cab view FILE.`);
  const problems = bad === 0 ? [] : [el('p', {class: 'report-problem', role: 'status'},
    `\u26a0 ${plural(bad, 'file')} could not be read in full; the tab Files says what is missing.`)];
  const states = report.files.reduce((sum, {frames_read: frames}) => sum + frames, 0);
  const what = hasStatesAlone(report) ? plural(states, 'state') : plural(report.files.length, 'recording');
  return el('header', {}, el('h2', {}, 'Contacts'),
    el('p', {}, report.interval_count === 0 ? `No contact in ${what}.` :
      `${plural(report.pair_count, 'pair')} of links ${report.pair_count === 1 ? 'touches' : 'touch'} in ${what}, ` +
      'worst first.'),
    ...problems, ...notes.map((note) => el('p', {class: 'quiet'}, note)));
}

/**
 * Fills an element with a report. `open` is called when a row with an embedded recording is opened, `picture` for the
 * worst of them.
 */
export function mountReport(element: HTMLElement, report: Report, open: OpenRecording,
                            picture: PictureOfRecording): void {
  const names = fileNames(report.files);
  const intervalsOf = intervalsByPair(report);
  const rowOptions = {
    openable: (row: Row) => openableRow(report, row),
    onOpen: (row: Row) => openRow(report, row, open),
  };
  const events = new EventsView({
    report, names, ...rowOptions,
    picture: async (row) => {
      const recording = report.files[row.file]?.recording;
      if (recording === null || recording === undefined) throw new Error('the recording is not in the page');
      return picture(recording, row.worst_frame, row);
    },
  });
  const intervals = new RowTable({
    caption: 'Intervals of contact', columns: intervalColumns(report, names),
    strip: (row) => makeStrip([row], row.worst_frame, framesOf(report, row)), ...rowOptions,
  });
  const pairs = new RowTable({
    caption: 'Pairs of links', columns: pairColumns(report, names),
    strip: (row) => makeStrip(intervalsOf(row), row.worst_frame, framesOf(report, row)), ...rowOptions,
  });
  const files = new RowTable<FileRow>({
    caption: 'Files', columns: fileColumns(),
    openable: ({file, worst}) => file.recording === null ? {reason: notEmbeddedText(file)} :
      worst ? openableRow(report, worst) : {reason: 'Nothing touches in it'},
    onOpen: ({worst}) => { if (worst) openRow(report, worst, open); },
  });
  const matrix = new MatrixView(report, names, (pair) => openRow(report, pair, open));
  const bar = new FilterBar(report, names, () => show());
  const show = (): void => {
    const {filter} = bar;
    const passing = filterPairs(report, filter);
    const shown = filterIntervals(report, filter);
    events.setIntervals(shown);
    intervals.setRows(shown, report.intervals.length);
    pairs.setRows(passing, report.pairs.length);
    matrix.setPairs(passing);
  };
  show();
  const rows = fileRows(report, names);
  files.setRows(rows, rows.length);
  element.replaceChildren(el('section', {class: 'report', 'aria-label': 'Report'}, heading(report), bar.element,
    makeTabs([
      ['Events', events.element],
      // States that follow each other are no intervals.
      ...(hasStatesAlone(report) ? [] : [['Intervals', intervals.element] as const]),
      ['Pairs', pairs.element],
      ['Matrix', matrix.element],
      // One file without a problem is named by the title.
      ...(rows.length > 1 || rows.some(({file}) => file.problems.length > 0) ?
        [['Files', files.element] as const] : []),
    ])));
}
