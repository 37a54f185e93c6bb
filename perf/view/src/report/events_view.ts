// The report at a glance: all events over time, a picture of the worst one, and each of them in two lines.
import {el, setText} from '../ui/dom.js';
import {count, plural, seconds} from '../ui/format.js';
import {eventsOf, framesOf, hasStates, type ReportEvent, worstOf} from './events.js';
import {makeEventStrip} from './event_strip.js';
import {pairTitle, severityText, shareText} from './texts.js';
import type {PictureOf, Report, ReportInterval, Row} from './types.js';

const EVENTS_PER_PAGE = 50;
const MOST_STRIPS = 8;

export interface EventsOptions {
  report: Report;
  /** Of the files. */
  names: readonly string[];
  /** Opens a row in the viewer. Null: its recording is not in the page, for this reason. */
  openable: (row: Row) => {readonly words: string} | {readonly reason: string};
  onOpen: (row: Row) => void;
  picture: PictureOf;
}

export class EventsView {
  readonly element: HTMLElement;
  readonly #options: EventsOptions;
  readonly #strips = el('div', {class: 'report-strips'});
  readonly #figure = el('figure', {class: 'report-worst', hidden: true});
  readonly #list = el('ol', {class: 'report-events'});
  readonly #more =
    el('button', {type: 'button', click: () => this.#show(this.#shown + EVENTS_PER_PAGE)}, 'More events');
  readonly #status = el('p', {class: 'quiet', role: 'status'});
  #events: ReportEvent[] = [];
  #shown = 0;
  /** What the picture is of. */
  #pictured: ReportInterval | null = null;

  constructor(options: EventsOptions) {
    this.#options = options;
    this.element = el('div', {class: 'report-overview'}, this.#strips, this.#figure, this.#list,
      el('div', {class: 'report-pages'}, this.#more, this.#status));
  }

  /** Shows what passes the filters. */
  setIntervals(intervals: readonly ReportInterval[]): void {
    this.#events = eventsOf(this.#options.report, intervals);
    this.#showStrips();
    this.#show(EVENTS_PER_PAGE);
    void this.#showPicture();
  }

  // One strip per recording whose frames have times, those with the worst events first.
  #showStrips(): void {
    const {report, names, onOpen} = this.#options;
    const files = [...new Set(this.#events.map(({file}) => file))].filter((file) => !hasStates(report.files[file]));
    const strips = files.slice(0, MOST_STRIPS).map((file) => {
      const events = this.#events.filter((event) => event.file === file);
      const words = files.length > 1 || report.files.length > 1 ? [el('span', {}, names[file] ?? '')] : [];
      return el('div', {class: 'report-file-strip'}, ...words,
        makeEventStrip(events, report.files[file]!, (event) => onOpen(worstOf(event))));
    });
    const rest = files.length - strips.length;
    this.#strips.replaceChildren(...strips,
      ...(rest > 0 ? [el('p', {class: 'quiet'}, `${plural(rest, 'more recording')} with milder events.`)] : []));
  }

  #show(most: number): void {
    this.#shown = Math.min(most, this.#events.length);
    this.#list.replaceChildren(...this.#events.slice(0, this.#shown).map((event) => this.#row(event)));
    const {length} = this.#events;
    this.#more.hidden = this.#shown === length;
    setText(this.#status, length === 0 ? 'Nothing passes the filters.' :
      this.#shown === length ? '' : `${count(this.#shown)} of ${count(length)} events`);
  }

  // Depth and time, then who it is.
  #row(event: ReportEvent): HTMLElement {
    const {report, names, openable, onOpen} = this.#options;
    const worst = worstOf(event), file = report.files[event.file], state = openable(worst);
    const isOpenable = 'words' in state;
    const more = event.pairs - 1;
    const button = el('button', {
      type: 'button', class: 'report-event', title: isOpenable ? state.words : state.reason,
      ...(isOpenable ? {click: () => this.#open(button, worst, onOpen)} : {'aria-disabled': 'true'}),
    },
      el('span', {class: 'event-depth'}, severityText(worst, file)),
      el('span', {class: 'event-time'}, whenOf(event, hasStates(file), file?.frames_read ?? 0)),
      el('span', {class: 'event-names'}, pairTitle(worst)),
      el('span', {class: 'event-more'},
        [more > 0 ? `and ${plural(more, 'pair')} more` : '', report.files.length > 1 ? names[event.file] ?? '' : '']
            .filter((words) => words !== '').join(', ')));
    return el('li', {}, button);
  }

  #open(button: HTMLElement, row: Row, onOpen: (row: Row) => void): void {
    for (const other of this.#list.querySelectorAll('.selected')) other.classList.remove('selected');
    button.classList.add('selected');
    onOpen(row);
  }

  // Of the worst event whose recording is in the page.
  async #showPicture(): Promise<void> {
    const {report, openable, onOpen, picture} = this.#options;
    const event = this.#events.find((one) => 'words' in openable(worstOf(one)));
    const worst = event ? worstOf(event) : null;
    if (worst === this.#pictured) return;
    this.#pictured = worst;
    this.#figure.hidden = true;
    if (!event || !worst) return;
    const file = report.files[worst.file];
    const address = await picture(worst).catch(() => null);
    if (address === null || this.#pictured !== worst) return;
    const words = `${severityText(worst, file)}, ${pairTitle(worst)}, ` +
        whenOf(event, hasStates(file), file?.frames_read ?? 0);
    this.#figure.replaceChildren(
      el('button', {type: 'button', title: 'Open it in the viewer', click: () => onOpen(worst)},
        el('img', {src: address, alt: `The worst contact: ${words}`, width: 640, height: 360})),
      el('figcaption', {class: 'quiet'}, `The worst: ${words}`));
    this.#figure.hidden = false;
  }
}

/** When an event is, and how long it lasts; of states in how many it is. */
export function whenOf(event: ReportEvent, isState: boolean, framesRead: number): string {
  const worst = worstOf(event), frames = framesOf(event);
  if (isState) {
    const share = framesRead > 0 ? ` (${shareText(frames / framesRead)})` : '';
    return `in ${plural(frames, 'state')}${share}, worst in state ${count(worst.worst_frame)}`;
  }
  const at = worst.worst_seconds === null ? `frame ${count(worst.worst_frame)}` : `at ${seconds(worst.worst_seconds)}`;
  const {firstSeconds, lastSeconds} = event;
  const lasts = firstSeconds === null || lastSeconds === null || lastSeconds <= firstSeconds ? plural(frames, 'frame') :
    `${seconds(lastSeconds - firstSeconds)}`;
  return `${at}, for ${lasts}`;
}
