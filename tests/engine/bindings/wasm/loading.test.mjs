// Which module is loaded. The test's second process runs in a node whose SIMD is off, as CAB_WITHOUT_SIMD tells it.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {fileURLToPath} from 'node:url';
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
