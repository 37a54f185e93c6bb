// The built page with data in it, in Chromium, without a network.
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';
import puppeteer, {type Page} from 'puppeteer-core';
import type {} from '../../perf/view/src/ui/page_api.js';

const VIEWER = fileURLToPath(new URL('../cab_view.html', import.meta.url));
const CHROMIUM = process.env['CAB_CHROMIUM'] ?? '/usr/bin/chromium';

export const recordingElement = (name: string, bytes: Uint8Array): string =>
  `<script type="application/octet-stream" class="cab-recording" data-name="${name}">` +
  `${Buffer.from(bytes).toString('base64')}</script>`;

export interface OpenPage {
  page: Page;
  /** What it prints as an error, and what it asks of a network. */
  errors: string[];
  close: () => Promise<void>;
}

/** Opens a page with `data` in the place of its line of data. */
export async function openPage(data: string): Promise<OpenPage> {
  const folder = mkdtempSync(join(tmpdir(), 'cab-page-')), path = join(folder, 'page.html'), errors: string[] = [];
  writeFileSync(path, readFileSync(VIEWER, 'utf8').replace('<!--CAB-DATA-->', () => data));
  const browser = await puppeteer.launch({
    executablePath: CHROMIUM, headless: true, userDataDir: join(folder, 'profile'),
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--disable-quic', '--no-first-run',
           '--disable-background-networking', '--disable-component-update', '--disable-sync'],
  });
  const page = await browser.newPage();
  await page.setViewport({width: 1280, height: 800});
  page.on('console', (message) => { if (message.type() === 'error') errors.push(message.text()); });
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('request', (request) => { if (/^(https?|wss?):/.test(request.url())) errors.push(request.url()); });
  await page.goto(pathToFileURL(path).href);
  return {
    page,
    errors,
    async close() {
      await browser.close();
      rmSync(folder, {recursive: true, force: true});
    },
  };
}
