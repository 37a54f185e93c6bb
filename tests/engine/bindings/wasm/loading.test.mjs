// Which module is loaded. The test's second process runs in a node whose SIMD is off, as CAB_WITHOUT_SIMD tells it.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {cab, chain, folder} from './package.mjs';

const bytes = (name) => readFileSync(`${folder}/${name}`);

if (process.env.CAB_WITHOUT_SIMD) {
  test('without SIMD the module with it is refused, and load takes the other', async () => {
    assert.equal(cab.hasSimd(), false);
    assert.equal(WebAssembly.validate(bytes('cab_simd.wasm')), false);
    assert.equal(WebAssembly.validate(bytes('cab_scalar.wasm')), true);
    const module = await cab.load();
    assert.deepEqual(module.instructionSets, ['scalar']);
    const world = module.createWorld();
    const batch = world.addBatch(world.addArticulation(chain(1)), 2);
    assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
    const inline = await import(pathToFileURL(`${folder}/inline.js`));
    await assert.rejects(inline.load(), /there is no SIMD here/);
  });
} else {
  test('where SIMD runs, load takes the module with it', async () => {
    assert.equal(cab.hasSimd(), true);
    assert.deepEqual((await cab.load()).instructionSets, ['scalar', 'wasm128']);
  });

  test('load takes a module that is compiled already', async () => {
    const module = await WebAssembly.compile(bytes('cab_scalar.wasm'));
    assert.deepEqual((await cab.load({module})).instructionSets, ['scalar']);
  });

  test('load takes the address or the contents of a module, and nothing that is none', async () => {
    const url = pathToFileURL(`${folder}/cab_scalar.wasm`);
    for (const options of [{url}, {url: url.href}, {bytes: bytes('cab_scalar.wasm')},
                           {bytes: new Uint8Array(bytes('cab_scalar.wasm')).buffer}]) {
      assert.deepEqual((await cab.load(options)).instructionSets, ['scalar']);
    }
    // What a server of one page answers for a file that it does not have.
    const page = new TextEncoder().encode('<!doctype html>');
    await assert.rejects(cab.load({bytes: page}), /bytes is no WebAssembly module; a bundler may not have copied it/);
    await assert.rejects(cab.load({bytes: new ArrayBuffer(0)}), /bytes is no WebAssembly module/);
    await assert.rejects(cab.load({url: pathToFileURL(`${folder}/index.js`)}), /index.js is no WebAssembly module/);
    await assert.rejects(cab.load({url: pathToFileURL(`${folder}/none.wasm`)}), /ENOENT/);
    await assert.rejects(cab.load({url, simd: true}), {name: 'TypeError', message: /takes one of url and simd/});
    await assert.rejects(cab.load({path: '.'}), {name: 'TypeError', message: /load takes no 'path'/});
  });

  test('the inlined entry has the module with SIMD in itself, and all that the other has', async () => {
    const inline = await import(pathToFileURL(`${folder}/inline.js`));
    const module = await inline.load();
    assert.deepEqual(module.instructionSets, ['scalar', 'wasm128']);
    assert.deepEqual(Object.keys(inline).sort(), Object.keys(cab).sort());
    assert.equal(inline.World, cab.World);
    const world = module.createWorld();
    const batch = world.addBatch(world.addArticulation(chain(1)), 2);
    assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
    await assert.rejects(inline.load({simd: false}), {name: 'TypeError', message: /inline takes no 'simd'/});
    const checked = (await inline.load({checkViews: true})).createWorld();
    const poses = checked.addBatch(checked.addArticulation(chain(1)), 1).poses();
    checked.memory();
    assert.throws(() => poses[0], /get poses\(\) again/);
  });

  test('the modules import nothing but what load gives them', () => {
    for (const name of ['cab_simd.wasm', 'cab_scalar.wasm']) {
      const imports = WebAssembly.Module.imports(new WebAssembly.Module(bytes(name))).map((one) => one.name);
      assert.deepEqual(imports.sort(), ['clock_time_get', 'emscripten_notify_memory_growth', 'proc_exit']);
    }
  });

  test('in a node without SIMD the tests of this file for it pass', () => {
    // V8 offers SIMD where the CPU has SSE 4.1.
    const flag = process.arch === 'x64' ? ['--no-enable-sse4-1'] : [];
    if (!flag.length) {
      console.log(`skipped: no way is known to switch SIMD off on ${process.arch}`);
      return;
    }
    const {status, stdout, stderr} = spawnSync(process.execPath, [...flag, fileURLToPath(import.meta.url)],
                                               {env: {...process.env, CAB_WITHOUT_SIMD: '1', NODE_TEST_CONTEXT: ''}});
    assert.equal(status, 0, `${stdout}${stderr}`);
  });
}
