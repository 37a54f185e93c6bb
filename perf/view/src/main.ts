// The page: opens the recording that it carries or is given, and plays it.
import {embeddedRecordings, engineModule, placeInFragment} from './embedded.js';
import {createEngine} from './engine/engine.js';
import {readRecording} from './recording/reader.js';
import {Page} from './ui/page.js';
import './ui/style.css';
import {hasSimd} from 'cab-collision';

const page = new Page({
  embedded: embeddedRecordings(),
  read: readRecording,
  startEngine: async (recording) => createEngine(recording, {module: await engineModule(hasSimd())}),
});
window.cabPage = page;
document.getElementById('cab-root')!.replaceChildren(page.element);

function openPlace(): void {
  const place = placeInFragment();
  if (place) void page.open(place.recording, place.frame);
  else if (page.recordings.length > 0) void page.open(0);
}

window.addEventListener('hashchange', openPlace);
openPlace();
