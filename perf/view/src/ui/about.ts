// What a recording says of itself.
import type {Articulation, Recording} from '../recording/types.js';
import {el} from './dom.js';
import {count, plural} from './format.js';

function trianglesOf(shape: Articulation | undefined): string {
  const count = (shape?.leaves ?? []).reduce((sum, {triangles}) => sum + triangles.length / 3, 0);
  return count === 0 ? '' : ` with ${plural(count, 'triangle')}`;
}

export function aboutOf(recording: Recording): HTMLElement {
  const {header, batches, articulations, frameCount} = recording;
  const rows: [string, string][] = [
    ['Title', header.title || 'none'],
    ['Frames', `${count(frameCount)}${header.secondsPerFrame > 0 ?
      `, ${(1 / header.secondsPerFrame).toFixed(1)} per second` : ', of unknown length'}`],
    ['Unit', header.metresPerUnit > 0 ? `${header.metresPerUnit} m` : 'unknown'],
    ['Up', header.up || 'unknown, guessed'],
    ['Written by', `cab ${header.library}`],
    ['Run with', `${header.isa || 'unknown'}${header.threads > 0 ? `, ${plural(header.threads, 'thread')}` : ''}`],
    ['Poses', header.poseStep > 0 ? `rounded to 16 bits, translations to ${header.poseStep}` : 'as given'],
  ];
  const batchRows = batches.map(({articulation, instanceCount, name, staticBodies}, i) => {
    const shape = articulations[articulation];
    const what = staticBodies ? plural(instanceCount, 'static body', 'static bodies') :
      `${plural(instanceCount, 'character')} of ${plural(shape?.linkParents.length ?? 0, 'link')}, ` +
          `${plural(shape?.leaves.length ?? 0, 'leaf', 'leaves')}${trianglesOf(shape)}`;
    return el('li', {}, `${name || shape?.name || `batch ${i}`}: ${what}`);
  });
  return el('section', {class: 'about', 'aria-label': 'About this recording'},
    el('dl', {}, ...rows.map(([name, text]) => el('div', {}, el('dt', {}, name), el('dd', {}, text)))),
    el('h3', {}, 'Batches'), el('ul', {}, ...batchRows),
    ...(header.notes.length > 0 ? [el('h3', {}, 'Notes'), el('ul', {}, ...header.notes.map((note) =>
      el('li', {}, note)))] : []));
}
