// The program that replays recordings in node: perf/view/src/node/replay.ts, bundled beside this test.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import test from 'node:test';
import {fileURLToPath} from 'node:url';
import {pathOfFixture} from './fixture.js';
import {DEFINITIONS, frameOf} from './scene.js';
import {chunkOfContents, fileOf} from './write_recording.js';

const PROGRAM = fileURLToPath(new URL('replay.mjs', import.meta.url));
// What `cab replay` prints of it.
const HASH_OF_AVX512 = 'f4fc7d352146e890';

function replay(...options: string[]): {status: number | null; output: string; errors: string} {
  const {status, stdout, stderr} = spawnSync(process.execPath, [PROGRAM, ...options], {encoding: 'utf8'});
  return {status, output: stdout, errors: stderr};
}

function replayBytes(bytes: Uint8Array): ReturnType<typeof replay> {
  const folder = mkdtempSync(join(tmpdir(), 'cab-replay-'));
  try {
    const file = join(folder, 'scene.cab');
    writeFileSync(file, bytes);
    return replay(file);
  } finally {
    rmSync(folder, {recursive: true});
  }
}

test('a recording of another machine replays to its hash by both instruction sets', () => {
  for (const isa of ['scalar', 'wasm128']) {
    const {status, output, errors} = replay(pathOfFixture('avx512.cab'), '--isa', isa);
    assert.equal(errors, '');
    assert.ok(output.startsWith(`8 frames, 181 hits, hash ${HASH_OF_AVX512}, by ${isa} of cab `), output);
    assert.equal(status, 0);
  }
});

test('the first frame and hit that differ are named, and the program fails', () => {
  const {status, output, errors} =
      replayBytes(fileOf([chunkOfContents({...DEFINITIONS, frames: [frameOf(0), frameOf(1), frameOf(2)]})]));
  assert.match(output, /^3 frames, \d+ hits, hash [0-9a-f]{16}, by wasm128/);
  assert.match(errors, /^frame 0 differs: its hash was 0{16}, and is [0-9a-f]{16}: hit 0 was none, and is batch slot/m);
  assert.match(errors, /^3 of 3 frames differ$/m);
  assert.equal(status, 1);
});

test('what is cut off is told, and the rest is compared', () => {
  // Without rules there are no hits, and the hash is that of no bytes.
  const [first, second] = [0, 1].map((index) => {
    const frame = frameOf(index);
    return {...frame, settings: {...frame.settings, rules: []}, hits: new Uint32Array(0), contacts: null,
            hash: 0xcbf29ce484222325n};
  });
  const bytes = fileOf([chunkOfContents({...DEFINITIONS, frames: [first!]}), chunkOfContents({frames: [second!]})]);
  const whole = replayBytes(bytes);
  assert.equal(whole.errors, '');
  assert.equal(whole.status, 0);
  const {status, output, errors} = replayBytes(bytes.subarray(0, bytes.length - 48 - 8));
  assert.match(errors, /^Chunk 1 at byte \d+ is cut off: .* Its frame 1 and all that follows are lost\.\n$/);
  assert.match(output, /^1 frames, 0 hits/);
  assert.equal(status, 1);
});

test('what cannot be read is told in a line', () => {
  const text = replayBytes(new TextEncoder().encode('HIERARCHY'));
  assert.match(text.errors, /^scene.cab: at byte 0: this is no recording of cab.*\n$/);
  assert.equal(text.status, 1);
  const usage = replay();
  assert.match(usage.errors, /^usage: replay.mjs FILE.cab/);
  assert.equal(usage.status, 1);
  assert.match(replay('a.cab', '--isa', 'avx9').errors, /--isa is avx9, and neither scalar nor wasm128/);
  assert.match(replay('/nowhere/a.cab').errors, /ENOENT.*\/nowhere\/a.cab/);
  assert.match(replay('a.cab', '--speed').errors, /--speed/);
});
