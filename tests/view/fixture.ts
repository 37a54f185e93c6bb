// Recordings beside the tests. Bundled tests are in WORK/programs (perf/view/build.mjs), and these in WORK/tests/view.
import {readFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

export const pathOfFixture = (name: string): string =>
    fileURLToPath(new URL(`../tests/view/fixtures/${name}`, import.meta.url));

export const fixture = (name: string): Uint8Array => readFileSync(pathOfFixture(name));
