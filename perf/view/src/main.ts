// The page: opens the recording that it carries or is given, and plays it, or shows the report that it carries.
import {hasSimd} from 'cab-collision';
import {embeddedRecordings, embeddedReport, engineModule} from './embedded.js';
import {createEngine} from './engine/engine.js';
import {readRecording} from './recording/reader.js';
import {mountReport} from './report/mount_report.js';
import {Page} from './ui/page.js';
import './ui/style.css';

const report = embeddedReport();

const page = new Page({
  embedded: embeddedRecordings(),
  read: readRecording,
  startEngine: async (recording) => createEngine(recording, {module: await engineModule(hasSimd())}),
  showReport: report && ((element, open, picture) => mountReport(element, report, open, picture)),
});
window.cabPage = page;
document.getElementById('cab-root')!.replaceChildren(page.element);
