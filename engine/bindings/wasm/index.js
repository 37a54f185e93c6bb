// cab for JavaScript: which links of many articulated characters touch. An ES module over the C API of cab, compiled to
// WebAssembly. index.d.ts says what everything does; docs/wasm.md begins with a program.
import {enums, structs, version as abiVersion} from './abi.js';

// A module of one function that returns a vector: valid where the engine runs SIMD.
const SIMD_MODULE = new Uint8Array(
    [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11]);

const NUMBERS = {
  u8: {bytes: 1, array: Uint8Array, set: 'setUint8', get: 'getUint8', least: 0, most: 0xff},
  u16: {bytes: 2, array: Uint16Array, set: 'setUint16', get: 'getUint16', least: 0, most: 0xffff},
  i32: {bytes: 4, array: Int32Array, set: 'setInt32', get: 'getInt32', least: -0x80000000, most: 0x7fffffff},
  u32: {bytes: 4, array: Uint32Array, set: 'setUint32', get: 'getUint32', least: 0, most: 0xffffffff},
  f32: {bytes: 4, array: Float32Array, set: 'setFloat32', get: 'getFloat32'},
  f64: {bytes: 8, array: Float64Array, set: 'setFloat64', get: 'getFloat64'},
};
NUMBERS.size = NUMBERS.u32;
NUMBERS['*'] = NUMBERS.u32;

// The joint link of a merge whose children share no joint.
const NO_JOINT = 0xffff;
// The level of a debug draw that means the leaves.
const LEAF_LEVEL = 0xffffffff;

// What a table has under a name of the caller's. Names such as '__proto__' are those of every object, and of no entry.
const entryOf = (table, name) => Object.prototype.hasOwnProperty.call(table, name) ? table[name] : undefined;

// The last prototype of an object: Object.prototype, also that of another frame or context, or none.
const isRoot = (object) => object === null || object === Object.prototype ||
    Object.prototype.hasOwnProperty.call(object, 'isPrototypeOf');

// The members of what a call is given: its own, inherited ones and the getters of its class, whose methods are none.
function membersOf(where, values) {
  if (typeof values !== 'object' || values === null) throw new TypeError(`cab: ${where} is not an object`);
  if (isRoot(Object.getPrototypeOf(values))) return values;
  const members = Object.create(null);
  for (let of = values; !isRoot(of); of = Object.getPrototypeOf(of)) {
    for (const [key, {enumerable, get}] of Object.entries(Object.getOwnPropertyDescriptors(of))) {
      if ((enumerable || get) && !(key in members)) members[key] = values[key];
    }
  }
  return members;
}

// Throws for the first of the members that a call does not know.
function refuseRest(where, rest) {
  for (const key of Object.keys(rest)) throw new TypeError(`cab: ${where} takes no '${key}'`);
}

const FLOATS_OF_POSE = {quaternion_translation: 7, matrix3x4_rows: 12, matrix4x4_columns: 16};
function floatsOfPose(format) {
  const floats = entryOf(FLOATS_OF_POSE, format);
  if (floats) return floats;
  throw new TypeError(`cab: format is '${format}', and not one of ${Object.keys(FLOATS_OF_POSE).join(', ')}`);
}

const IDENTITY = {
  quaternion_translation: [0, 0, 0, 1, 0, 0, 0],
  matrix3x4_rows: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
  matrix4x4_columns: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
};

// The arrays that a batch may have besides its poses: their member of BatchInput, type and first values per instance.
const ARRAYS = {
  origins: {type: 'f64', fill: [0, 0, 0]},
  orientations: {type: 'f32', fill: [0, 0, 0, 1]},
  scales: {type: 'f32', fill: [1]},
  layers: {type: 'u32', fill: [0xffffffff]},
  layerMasks: {type: 'u32', fill: [0xffffffff]},
  margins: {type: 'f32', fill: [0]},
  moved: {type: 'u8', fill: [1]},
  flags: {type: 'u8', fill: [0]},
  inContact: {type: 'u8', fill: [0]},
};

// Those that say where an instance is, which a moment keeps.
const OF_MOMENT = new Set(['origins', 'orientations', 'scales', 'layers']);

// The statuses of calls that add something which say which element is at fault.
const HAS_ELEMENT = new Set(['bad_parent', 'bad_joint', 'bad_leaf_link', 'bad_leaf_box', 'bad_leaf_axes', 'bad_shape',
                             'shape_outside_leaf_box', 'bad_ignored_pair', 'bad_static_body', 'bad_triangles',
                             'bad_lod', 'lod_leaf_too_small', 'bad_skin', 'bad_leaf_triangles',
                             'too_many_influences']);
const NO_ELEMENT = 0xffffffff;

// SurfacePoint::triangle of a hit that is not on triangles.
const NO_TRIANGLE = 0xffffffff;

const nameOf = (enumeration, value) =>
    Object.keys(enums[enumeration].values).find((name) => enums[enumeration].values[name] === value) ?? value;

export class CabError extends Error {
  constructor(code, words, element) {
    const name = nameOf('Status', code);
    super(element === undefined ? words : `${words} (element ${element})`);
    this.name = 'CabError';
    this.status = name;
    this.code = code;
    this.element = element;
  }
}

// ---------------------------------------------------------------------------------------------------------- loading

export const hasSimd = () => WebAssembly.validate(SIMD_MODULE);

// The first bytes of every WebAssembly module.
const MAGIC = [0, 97, 115, 109];

const NOT_THERE = 'a bundler may not have copied it: docs/wasm.md has recipes';

async function compile(bytes, from) {
  const start = new Uint8Array(bytes.buffer ?? bytes, bytes.byteOffset ?? 0, Math.min(4, bytes.byteLength));
  if (MAGIC.some((byte, i) => byte !== start[i])) {
    throw new Error(`cab: ${from} is no WebAssembly module; ${NOT_THERE}`);
  }
  return WebAssembly.compile(bytes);
}

async function fetched(url) {
  if (url.protocol === 'file:') {
    const node = 'node:fs/promises';  // by a name that bundlers for browsers do not look for
    const {readFile} = await import(/* webpackIgnore: true */ /* @vite-ignore */ node);
    return compile(await readFile(url), url);
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`cab: ${url}: ${response.status} ${response.statusText}; ${NOT_THERE}`);
  return compile(await response.arrayBuffer(), url);
}

// The module that load() is told to take.
function compiledOf({module, bytes, url, simd}) {
  const given = Object.entries({module, bytes, url, simd}).filter(([, value]) => value !== undefined);
  if (given.length > 1) throw new TypeError(`cab: load takes one of ${given.map(([name]) => name).join(' and ')}`);
  if (module) return module;
  if (bytes) return compile(bytes, 'bytes');
  if (url) return fetched(new URL(url, globalThis.document?.baseURI ?? globalThis.location?.href ?? import.meta.url));
  return fetched(simd ?? hasSimd() ? new URL('./cab_simd.wasm', import.meta.url)
                                   : new URL('./cab_scalar.wasm', import.meta.url));
}

export async function load(options = {}) {
  const {module, bytes, url, simd, checkViews = false, ...rest} = membersOf('options of load', options);
  refuseRest('load', rest);
  const compiled = await compiledOf({module, bytes, url, simd});
  const ended = (code) => {
    throw new Error(`cab: the module has ended with ${code}`);
  };
  let memory;
  const instance = await WebAssembly.instantiate(compiled, {
    env: {emscripten_notify_memory_growth() {}},
    wasi_snapshot_preview1: {
      proc_exit: ended,
      clock_time_get(clock, precision, at) {
        new DataView(memory.buffer).setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true);
        return 0;
      },
    },
  });
  memory = instance.exports.memory;
  instance.exports._initialize();
  return new Cab(instance.exports, checkViews);
}

// ----------------------------------------------------------------------------------------------------------- memory

// Values of a span that are in the memory of the module.
class Place {
  constructor(data, size) {
    this.data = data;
    this.size = size;
  }
}

// The most memory that is kept from one call to the next for what calls borrow. More is given back after its call.
const KEPT_BYTES = 1 << 20;

// Writes and reads structs of the C API in the memory of the module. Its own memory, for what a call borrows, is taken
// between open() and close().
class Structs {
  #view;
  #block = {at: 0, bytes: 0};
  #used = 0;
  #more = [];  // blocks that one call needed besides
  #isLent = false;

  constructor(exports, checksViews) {
    this.exports = exports;
    this.memory = exports.memory;
    this.checksViews = checksViews;
    this.#view = new DataView(this.memory.buffer);
  }

  // Memory that has grown has another buffer.
  get view() {
    if (this.#view.buffer !== this.memory.buffer) this.#view = new DataView(this.memory.buffer);
    return this.#view;
  }

  error(code, element) { return new CabError(code, this.text(this.exports.cab_status_to_string(code)), element); }

  check(code, element) {
    if (code !== 0) throw this.error(code, element);
  }

  allocate(bytes) {
    const at = bytes <= 0x7fffffff ? this.exports.malloc(Math.max(bytes, 1)) >>> 0 : 0;
    if (!at) throw this.error(enums.Status.values.out_of_memory);
    this.#endViews();
    return at;
  }

  // Throws if a call is at work: a getter of what it was given cannot make another one, which would take its memory.
  refuseNested() {
    if (this.#isLent) throw new Error('cab: a getter or an iterator of what a call was given makes another call');
  }

  // Runs `call` with memory that is taken back afterwards.
  borrowed(call) {
    this.refuseNested();
    this.#isLent = true;
    try {
      return call();
    } finally {
      this.#isLent = false;
      if (this.#more.length) {
        let bytes = 2 * this.#block.bytes;
        for (const {at, bytes: of} of this.#more) {
          this.exports.free(at);
          bytes += of;
        }
        this.#more = [];
        bytes = Math.min(bytes, KEPT_BYTES);
        if (bytes > this.#block.bytes) {
          this.exports.free(this.#block.at);
          const at = this.exports.malloc(bytes);
          this.#block = {at, bytes: at ? bytes : 0};
        }
      }
      this.#used = 0;
      this.#endViews();
    }
  }

  // Where views are checked, they end whenever the memory may have grown, and not only when it has.
  #endViews() {
    if (this.checksViews) this.memory.grow(0);
  }

  take(bytes) {
    const begin = (this.#used + 15) & ~15;
    if (begin + bytes <= this.#block.bytes) {
      this.#used = begin + bytes;
      return this.#block.at + begin;
    }
    const at = this.allocate(bytes);
    this.#more.push({at, bytes: bytes + 16});
    return at;
  }

  text(at) {
    const bytes = new Uint8Array(this.memory.buffer);
    return new TextDecoder().decode(bytes.subarray(at, bytes.indexOf(0, at)));
  }

  array(type, at, length) { return new NUMBERS[type].array(this.memory.buffer, at, length); }

  // The same for the caller to keep. owner._alive() throws once its memory is no longer its own.
  lend(what, type, at, length, owner) {
    const array = this.array(type, at, length);
    return this.checksViews ? checkedView(what, array, this.memory, owner) : array;
  }

  // The address of a new struct with its defaults, and with the members that `values` has.
  make(name, values = {}) {
    const members = this.read(name, values), at = this.take(structs[name].size);
    this.#fill(name, at, members);
    return at;
  }

  // What a struct is given, as plain objects and arrays that last: the call may make the memory grow, which ends views
  // of it. So all that a call is given is read before it takes memory.
  read(name, values) {
    const members = {}, given = membersOf(name, values);
    for (const key of Object.keys(given)) {
      const member = entryOf(structs[name].members, key), value = given[key];
      if (!member) throw new TypeError(`cab: ${name} has no member '${key}'`);
      if (value !== undefined) members[key] = this.#readMember(member.type, value);
    }
    return members;
  }

  #readMember(type, value) {
    if (type.startsWith('[')) {
      const of = type.slice(1, -1);
      if (!structs[of] || ID_CLASSES[of] || typeof value?.length !== 'number') return this.lasting(value);
      return Array.from({length: value.length}, (_, i) => this.read(of, value[i]));
    }
    return structs[type] && !ID_CLASSES[type] ? this.read(type, value) : this.lasting(value);
  }

  // A copy of a view of this memory; all else as it is.
  lasting(value) { return value?.buffer && value.buffer === this.memory.buffer ? value.slice() : value; }

  #fill(name, at, values) {
    const {hasDefault, members} = structs[name];
    if (name === 'HistoryId') {
      if (!(values instanceof History)) throw new TypeError('cab: a history is not what addHistory returns');
      this.view.setBigUint64(at, this.idOf('a history', values), true);
      return;
    }
    if (hasDefault) this.exports[`cab_default_${snake(name)}`](at);
    else for (const key of Object.keys(members)) {
      if (values[key] === undefined) throw new TypeError(`cab: ${name} needs '${key}'`);
    }
    this.#write(name, at, values);
  }

  set(name, at, values) { this.#write(name, at, this.read(name, values)); }

  // Writes members that have been read, or that the module made.
  #write(name, at, values) {
    const {members} = structs[name];
    for (const key of Object.keys(values)) {
      this.#setMember(`${name}.${key}`, members[key], at + members[key].at, values[key]);
    }
  }

  #setMember(where, {type, count}, at, value) {
    if (type.startsWith('[')) {
      const {data, size} = this.span(where, type.slice(1, -1), value);
      this.setSpan(at, data, size);
    } else if (count) {
      const flat = ArrayBuffer.isView(value) ? value : Array.from(value ?? []).flat();
      if (flat.length !== count) throw new TypeError(`cab: ${where} needs ${count} numbers, not ${flat.length}`);
      for (let i = 0; i < count; ++i) this.#setNumber(where, type, at + i * NUMBERS[type].bytes, flat[i]);
    } else if (type === 'ArticulationId' || type === 'BatchId') {
      if (!(value instanceof ID_CLASSES[type])) {
        throw new TypeError(`cab: ${where} is not what ${type === 'BatchId' ? 'addBatch' : 'addArticulation'} returns`);
      }
      this.view.setBigUint64(at, this.idOf(where, value), true);
    } else if (structs[type]) {
      this.#write(type, at, value);
    } else {
      this.#setNumber(where, type, at, value);
    }
  }

  // The id of a batch or articulation. Those of another module may have the same ids, and their memory is not this one.
  idOf(where, what) {
    if (what.id === null) throw new TypeError(`cab: ${where} has been removed`);
    if (!what._isOf(this)) throw new TypeError(`cab: ${where} is of another module`);
    return what.id;
  }

  #setNumber(where, type, at, value) {
    if (enums[type]) {
      const number = entryOf(enums[type].values, value);
      if (number === undefined) {
        const names = Object.keys(enums[type].values).join(', ');
        throw new TypeError(`cab: ${where} is '${value}', and not one of ${names}`);
      }
      type = enums[type].type;
      value = number;
    }
    if (type === 'bool') {
      this.view.setUint8(at, value ? 1 : 0);
      return;
    }
    this.checkNumber(where, type, value);
    this.view[NUMBERS[type].set](at, value, true);
  }

  // Throws unless a value is a number of the type.
  checkNumber(where, type, value) {
    const {least, most} = NUMBERS[type];
    if (typeof value !== 'number') throw new TypeError(`cab: ${where} is not a number: ${value}`);
    if (least !== undefined && !(Number.isInteger(value) && least <= value && value <= most)) {
      throw new RangeError(`cab: ${where} is ${value}, and not a whole number from ${least} to ${most}`);
    }
  }

  // Copies the values of a span into the module's memory, unless they have a Place there.
  span(where, type, value) {
    if (value instanceof Place) return value;
    if (typeof value?.length !== 'number') throw new TypeError(`cab: ${where} is not an array`);
    value = this.lasting(value);
    const {length} = value;
    if (!length) {
      refuseDetached(where, value);
      return {data: 0, size: 0};
    }
    if (structs[type]) {
      const {size} = structs[type];
      const data = this.take(size * length);
      for (let i = 0; i < length; ++i) this.#fill(type, data + i * size, value[i]);
      return {data, size: length};
    }
    const {array: Values, bytes} = NUMBERS[type];
    const data = this.take(bytes * length);
    if (value instanceof Values) this.array(type, data, length).set(value);
    else for (let i = 0; i < length; ++i) this.#setNumber(where, type, data + i * bytes, value[i]);
    return {data, size: length};
  }

  setSpan(at, data, size) {
    this.view.setUint32(at, data, true);
    this.view.setUint32(at + 4, size, true);
  }

  // The address of a new span of so many values.
  spanAt(data, size) {
    const at = this.take(8);
    this.setSpan(at, data, size);
    return at;
  }

  // Copies the poses of so many links, by instance, into the module's memory: a view of them, and of how many instances
  // they are. `count`: how many they must be.
  poses(where, {format = 'quaternion_translation', hasScale = false, data, ...rest}, links, count) {
    for (const key of Object.keys(rest)) throw new TypeError(`cab: ${where} has no member '${key}'`);
    const floats = floatsOfPose(format) * links;
    const {data: at, size} = this.span(`${where}.data`, 'f32', data);
    const wanted = count === undefined ? `a multiple of ${floats}` : `${floats * count}`;
    if (size === 0 || (count === undefined ? size % floats !== 0 : size !== floats * count)) {
      throw new TypeError(`cab: ${where}.data needs ${wanted} numbers, not ${size}`);
    }
    return {view: {format, hasScale, data: at}, count: size / floats};
  }

  // A struct as an object. Spans and pointers are left out.
  get(name, at) {
    const out = {};
    for (const [key, {at: offset, type, count}] of Object.entries(structs[name].members)) {
      if (type.startsWith('[') || type === '*') continue;
      if (count) out[key] = Array.from(this.array(type, at + offset, count));
      else out[key] = structs[type] ? this.get(type, at + offset) : this.#getNumber(type, at + offset);
    }
    return out;
  }

  member(name, key, at) { return this.#getNumber(structs[name].members[key].type, at + structs[name].members[key].at); }

  #getNumber(type, at) {
    if (enums[type]) return nameOf(type, this.view[NUMBERS[enums[type].type].get](at, true));
    if (type === 'bool') return this.view.getUint8(at) !== 0;
    if (type === 'u64') return Number(this.view.getBigUint64(at, true));
    if (type === 'text') return this.text(this.view.getUint32(at, true));
    return this.view[NUMBERS[type].get](at, true);
  }
}

// A typed array that throws once it has ended.
function checkedView(what, array, memory, owner) {
  const check = () => {
    owner._alive();
    if (array.buffer === memory.buffer) return;
    throw new Error(`cab: a call has been made since this view, in which the memory may grow; get ${what} again`);
  };
  // What a method returns: the array itself, a part of it, or what lasts.
  const checked = (result) => {
    if (result === array) return view;
    return result instanceof array.constructor && result.buffer === array.buffer
        ? checkedView(what, result, memory, owner) : result;
  };
  const handler = {
    get(_, key) {
      check();
      const value = Reflect.get(array, key);  // with the array as `this`, since getters take no proxy
      if (typeof value !== 'function' || key === 'constructor') return value;
      return (...values) => {
        check();
        return checked(value.apply(array, values));
      };
    },
    set(_, key, value) {
      check();
      return Reflect.set(array, key, value);
    },
  };
  for (const trap of ['has', 'ownKeys', 'getOwnPropertyDescriptor', 'defineProperty']) {
    handler[trap] = (...values) => {
      check();
      return Reflect[trap](...values);
    };
  }
  const view = new Proxy(array, handler);
  return view;
}

const snake = (name) => name.replace(/(?<=[a-z0-9])(?=[A-Z])/g, '_').toLowerCase();

// -------------------------------------------------------------------------------------------------------------- cab

export class Cab {
  #structs;

  constructor(exports, checksViews) {
    this.exports = exports;
    this.memory = exports.memory;
    this.#structs = new Structs(exports, checksViews);
  }

  get instructionSets() {
    const {values} = enums.Isa;
    return Object.keys(values).filter((name) => name !== 'auto' && this.exports.cab_isa_available(values[name]));
  }

  get version() {
    return this.#structs.borrowed(() => {
      const out = this.#structs.take(structs.Version.size);
      this.exports.cab_version(out);
      return this.#structs.member('Version', 'text', out);
    });
  }

  createWorld(desc = {}) { return new World(this.#structs, desc); }

  fitBox(vertices) {
    const structs_ = this.#structs;
    return structs_.borrowed(() => {
      const {data, size} = structs_.span('vertices', 'f32', vertices);
      const span = structs_.spanAt(data, size), box = structs_.take(structs.Box.size);
      structs_.check(this.exports.cab_fit_box(span, box));
      return structs_.get('Box', box);
    });
  }
}

// ------------------------------------------------------------------------------------------------------------ world

class Articulation {
  #structs;

  constructor(structs_, id, info) {
    this.#structs = structs_;
    this.id = id;
    this.linkCount = info.linkCount;
    this.leafCount = info.leafCount;
    this.nodeCount = info.nodeCount;
    Object.freeze(this);
  }

  _isOf(structs_) { return this.#structs === structs_; }
}

export class Batch {
  #structs;
  #kind;
  #poses = 0;
  #arrays = new Map();  // name -> address

  constructor(structs_, id, articulation, size, {format = null, hasScale = false, kind = 'characters'}) {
    this.#structs = structs_;
    this.#kind = kind;
    this.id = id;
    this.slot = Number(id & 0xffffffffn);
    this.articulation = articulation;
    this.size = size;
    this.format = format;
    this.hasScale = hasScale;
    this.count = size;
    this.instances = null;
    if (!articulation) return;
    const floats = FLOATS_OF_POSE[format];
    const poses = size * articulation.linkCount;
    this.#poses = structs_.allocate(4 * floats * poses);
    fillWith(this.poses(), IDENTITY[format]);
  }

  poses() {
    this._alive();
    if (!this.#poses) throw new TypeError('cab: static bodies have no poses');
    const floats = FLOATS_OF_POSE[this.format] * this.size * this.articulation.linkCount;
    return this.#structs.lend('poses()', 'f32', this.#poses, floats, this);
  }

  origins() { return this.#array('origins'); }
  orientations() { return this.#array('orientations'); }
  scales() { return this.#array('scales'); }
  layers() { return this.#array('layers'); }
  layerMasks() { return this.#array('layerMasks'); }
  margins() { return this.#array('margins'); }
  moved() { return this.#array('moved'); }
  flags() { return this.#array('flags'); }
  inContact() { return this.#array('inContact'); }

  #array(name) {
    const {type, fill} = ARRAYS[name];
    this._alive();
    const isNew = !this.#arrays.has(name);
    if (isNew) this.#arrays.set(name, this.#structs.allocate(NUMBERS[type].bytes * fill.length * this.size));
    const array = this.#structs.lend(`${name}()`, type, this.#arrays.get(name), fill.length * this.size, this);
    if (isNew) fillWith(array, fill);
    return array;
  }

  moment() {
    this._alive();
    const arrays = {};
    for (const [name, at] of this.#arrays) {
      const {type, fill} = ARRAYS[name];
      if (OF_MOMENT.has(name)) arrays[name] = this.#structs.array(type, at, fill.length * this.size).slice();
    }
    const poses = this.#poses ? this.poses().slice() : null;
    const {count, instances} = this._input();
    return new Moment(this, {count, instances: instances && Array.from(instances), poses, arrays});
  }

  _isOf(structs_) { return this.#structs === structs_; }

  _isSequence() { return this.#kind === 'sequence'; }

  _alive() {
    if (this.id === null) throw new TypeError('cab: the batch has been removed');
  }

  // What a call is given of the batch, before it takes memory.
  _input() {
    const input = {batch: this, count: this.count};
    if (this.#poses) input.poses = {format: this.format, hasScale: this.hasScale, data: this.#poses};
    if (this.instances?.length === 0) {
      refuseDetached('Batch.instances', this.instances);
      input.count = 0;  // to the engine an empty list is all instances
    } else if (this.instances !== null && this.instances !== undefined) {
      input.instances = this.#structs.lasting(this.instances);
    }
    for (const [name, at] of this.#arrays) input[name] = new Place(at, ARRAYS[name].fill.length * this.size);
    return input;
  }

  _release() {
    if (this.#poses) this.#structs.exports.free(this.#poses);
    for (const at of this.#arrays.values()) this.#structs.exports.free(at);
    this.#poses = 0;
    this.#arrays.clear();
    this.id = null;
  }
}

// What a batch was at one moment, in memory of JavaScript.
export class Moment {
  #values;

  constructor(batch, values) {
    this.batch = batch;
    this.#values = values;
    Object.freeze(this);
  }

  // As Batch._input; the poses go to memory that a call borrows.
  _input(structs_) {
    const {batch} = this, {count, instances, poses, arrays} = this.#values;
    const input = {batch, count, ...arrays};
    if (instances) input.instances = instances;
    if (poses) {
      const given = {format: batch.format, hasScale: batch.hasScale, data: poses};
      input.poses = structs_.poses('Moment', given, batch.articulation.linkCount, batch.size).view;
    }
    return input;
  }
}

// The poses of a batch at its last moments.
export class History {
  #structs;
  #engineOf;

  constructor(structs_, engineOf, batch, id) {
    this.#structs = structs_;
    this.#engineOf = engineOf;
    this.batch = batch;
    this.id = id;
  }

  _isOf(structs_) { return this.#structs === structs_; }

  record(time, moment) {
    const structs_ = this.#structs, engine = this.#engineOf();
    if (typeof time !== 'number') throw new TypeError(`cab: a time is a number, not ${time}`);
    const id = structs_.idOf('the history', this);
    structs_.borrowed(() => {
      const input = structs_.make('BatchInput', moment ? momentInput(structs_, moment) : inputOf(this.batch));
      structs_.check(structs_.exports.cab_record_tick(engine, id, input, time));
    });
  }

  get span() {
    const structs_ = this.#structs, engine = this.#engineOf(), id = structs_.idOf('the history', this);
    return structs_.borrowed(() => {
      const out = structs_.take(structs.HistorySpan.size);
      structs_.check(structs_.exports.cab_history_span(engine, id, out));
      return structs_.get('HistorySpan', out);
    });
  }

  remove() {
    const structs_ = this.#structs;
    structs_.check(structs_.exports.cab_remove_history(this.#engineOf(), structs_.idOf('the history', this)));
    this.id = null;
  }
}

// The classes of what ids stand for.
const ID_CLASSES = {ArticulationId: Articulation, BatchId: Batch, HistoryId: History};

function momentInput(structs_, moment) {
  if (!(moment instanceof Moment)) throw new TypeError('cab: this is not what Batch.moment returns');
  return moment._input(structs_);
}

// A view of memory that has grown has length 0, but does not mean an empty list.
function refuseDetached(where, view) {
  if (!ArrayBuffer.isView(view)) return;
  try {
    new Uint8Array(view.buffer);
  } catch {
    throw new TypeError(`cab: ${where} is a view of memory that has grown since; ask for it again`);
  }
}

function inputOf(batch) {
  if (!(batch instanceof Batch)) throw new TypeError('cab: this is not a batch');
  return batch._input();
}

function fillWith(array, values) {
  array.set(values);
  for (let filled = values.length; filled < array.length; filled *= 2) array.copyWithin(filled, 0, filled);
}

export class World {
  #structs;
  #engine;
  #batches = new Map();      // slot -> Batch: replaced when it changes, since hits keep that of their frame
  #onlyBatches = new Map();  // slot -> the one Batch that it has stood for, or null if it was several
  #made = new WeakSet();     // all batches, those that were removed, too
  #hits = {at: 0, contacts: 0, room: 0};
  #found = {at: 0, points: 0, room: 0};
  #triangles = {at: 0, room: 0};
  #frame = 0;
  #asked = 0;
  #searched = 0;

  constructor(structs_, desc) {
    this.#structs = structs_;
    const {isa = 'auto', ...rest} = membersOf('desc', desc);
    refuseRest('createWorld', rest);
    this.#engine = structs_.borrowed(() => {
      const out = structs_.take(4);
      structs_.check(structs_.exports.cab_create_engine(abiVersion, structs_.make('EngineDesc', {isa}), out));
      return structs_.view.getUint32(out, true);
    });
  }

  get isa() { return nameOf('Isa', this.#exports.cab_engine_isa(this.#alive())); }

  get #exports() { return this.#structs.exports; }

  #alive() {
    this.#structs.refuseNested();
    if (!this.#engine) throw new TypeError('cab: the world has been destroyed');
    return this.#engine;
  }

  destroy() {
    if (!this.#engine) return;
    this.#structs.refuseNested();
    for (const batch of this.#batches.values()) batch._release();
    this.#exports.cab_destroy_engine(this.#engine);
    const {at, contacts} = this.#hits;
    for (const kept of [at, contacts, this.#found.at, this.#found.points, this.#triangles.at]) this.#exports.free(kept);
    this.#hits = {at: 0, contacts: 0, room: 0};
    this.#found = {at: 0, points: 0, room: 0};
    this.#triangles = {at: 0, room: 0};
    this.#engine = 0;
    ++this.#frame;
    ++this.#asked;
    ++this.#searched;
  }

  // Calls call(engine, desc, out, badElement), which adds something, and returns its id. descOf() makes the members of
  // the description while memory is borrowed.
  #add(call, name, descOf) {
    const structs_ = this.#structs, engine = this.#alive();
    return structs_.borrowed(() => {
      const desc = structs_.make(name, descOf()), out = structs_.take(8), bad = structs_.take(4);
      structs_.view.setUint32(bad, NO_ELEMENT, true);
      const code = call(engine, desc, out, bad);
      const element = structs_.view.getUint32(bad, true);
      structs_.check(code, HAS_ELEMENT.has(nameOf('Status', code)) && element !== NO_ELEMENT ? element : undefined);
      return structs_.view.getBigUint64(out, true);
    });
  }

  addArticulation(desc) {
    return this.#articulation(this.#add(this.#exports.cab_add_articulation, 'ArticulationDesc', () => {
      const {restPose, ...rest} = this.#structs.read('ArticulationDesc', desc);
      // Without links the engine has its own words.
      if (restPose && rest.linkParents?.length) {
        rest.restPose = this.#structs.poses('restPose', restPose, rest.linkParents.length, 1).view;
      }
      return rest;
    }));
  }

  addLod(desc) {
    if (!(desc.of instanceof Articulation)) throw new TypeError('cab: LodDesc.of is not what addArticulation returns');
    return this.#articulation(this.#add(this.#exports.cab_add_lod, 'LodDesc', () => {
      const {restPoses, ...rest} = this.#structs.read('LodDesc', desc);
      if (restPoses) {
        const {view, count} = this.#structs.poses('restPoses', restPoses, rest.of.linkCount);
        Object.assign(rest, {restPoses: view, restPoseCount: count});
      }
      return rest;
    }));
  }

  #articulation(id) {
    const info = this.#read('ArticulationInfo', (out) => this.#exports.cab_articulation_info(this.#engine, id, out));
    return new Articulation(this.#structs, id, info);
  }

  mergeSteps(articulation) {
    const structs_ = this.#structs, engine = this.#alive();
    if (!(articulation instanceof Articulation)) throw new TypeError('cab: this is not an articulation');
    const id = structs_.idOf('the articulation', articulation), {size} = structs.MergeStep;
    return structs_.borrowed(() => {
      const count = articulation.nodeCount - articulation.leafCount, at = structs_.take(size * count);
      structs_.check(this.#exports.cab_merge_steps(engine, id, structs_.spanAt(at, count)));
      return Array.from({length: count}, (_, step) => {
        const {jointLink, ...children} = structs_.get('MergeStep', at + size * step);
        return {...children, jointLink: jointLink === NO_JOINT ? null : jointLink};
      });
    });
  }

  #read(name, call) {
    const structs_ = this.#structs;
    return structs_.borrowed(() => {
      const out = structs_.take(structs[name].size);
      structs_.check(call(out));
      return structs_.get(name, out);
    });
  }

  addBatch(articulation, size, options = {}) {
    const {
      kind, format = 'quaternion_translation', hasScale = false, ...rest
    } = membersOf('options of addBatch', options);
    refuseRest('addBatch', rest);
    floatsOfPose(format);
    const id = this.#add(this.#exports.cab_add_batch, 'BatchDesc', () => ({articulation, instanceCount: size, kind}));
    let batch;
    try {
      batch = new Batch(this.#structs, id, articulation, size, {format, hasScale, kind});
    } catch (error) {
      this.#exports.cab_remove_batch(this.#engine, id);
      throw error;
    }
    return this.#keep(batch);
  }

  #keep(batch) {
    const {slot} = batch;
    this.#batches = new Map(this.#batches).set(slot, batch);
    this.#onlyBatches.set(slot, this.#onlyBatches.has(slot) ? null : batch);
    this.#made.add(batch);
    return batch;
  }

  addStaticBatch(desc) {
    let size;
    const id = this.#add(this.#exports.cab_add_static_batch, 'StaticDesc', () => {
      const members = this.#structs.read('StaticDesc', desc);
      size = (members.bodies?.length ?? 0) + (members.triangles?.length ?? 0) / 3;
      return members;
    });
    return this.#keep(new Batch(this.#structs, id, null, size, {}));
  }

  remove(what) {
    const structs_ = this.#structs, engine = this.#alive();
    const isBatch = what instanceof Batch;
    if (!isBatch && !(what instanceof Articulation)) {
      throw new TypeError('cab: this is neither a batch nor an articulation');
    }
    const call = isBatch ? this.#exports.cab_remove_batch : this.#exports.cab_remove_articulation;
    structs_.check(call(engine, structs_.idOf('what is to be removed', what)));
    if (!isBatch) return;
    this.#batches = new Map(this.#batches);
    this.#batches.delete(what.slot);
    what._release();
    ++this.#frame;
    ++this.#asked;
  }

  reserve(desc) {
    const structs_ = this.#structs, engine = this.#alive();
    structs_.borrowed(() => structs_.check(this.#exports.cab_reserve(engine, structs_.make('ReserveDesc', desc))));
  }

  memory() {
    const engine = this.#alive();
    return this.#read('EngineMemory', (out) => this.#exports.cab_engine_memory(engine, out));
  }

  whyMasked(batch, instance) {
    const engine = this.#alive(), input = inputOf(batch);
    this.#structs.checkNumber('instance', 'u32', instance);
    return this.#read('MaskReason', (out) => this.#exports.cab_why_masked(
                                        engine, this.#structs.make('BatchInput', input), instance, out));
  }

  computeBoxes(batch, policies = {}) {
    const structs_ = this.#structs, engine = this.#alive(), input = inputOf(batch);
    if (!batch.articulation) throw new TypeError('cab: static bodies have no hierarchy');
    const {nodeCount} = batch.articulation, {size} = structs.Box;
    return structs_.borrowed(() => {
      const count = batch.size * nodeCount, floats = size / 4 * count;
      const at = structs_.take(size * count), made = structs_.make('Policies');
      this.#setPolicies(made, policies);
      structs_.array('f32', at, floats).fill(0);
      const given = structs_.make('BatchInput', input);
      structs_.check(this.#exports.cab_compute_boxes(engine, given, made, structs_.spanAt(at, count)));
      return {nodeCount, leafCount: batch.articulation.leafCount, values: structs_.array('f32', at, floats).slice()};
    });
  }

  // ----------------------------------------------------------------------------------------------------------- frame

  // Writes what a frame is given, and whether contacts are wanted. Room for hits is not given yet.
  #frameJob(job) {
    const structs_ = this.#structs;
    const {
      rules: given = [], batches, policies = {}, contacts = false, margin, minDepth, report, containment, ...rest
    } = membersOf('the job', job);
    refuseRest('runFrame', rest);
    const rules = given.map((rule) => {
      const {a, b = a, ...how} = membersOf('PairRule', rule);
      return {a, b, ...how};
    });
    const inputs = [...new Set(batches ?? rules.flatMap(({a, b}) => [a, b]))];
    const at = structs_.make('FrameJob', {inputs: inputs.map(inputOf), rules, margin, minDepth, report, containment});
    this.#setPolicies(at + structs.FrameJob.members.policies.at, policies);
    return {at, wantsContacts: contacts || report === 'distances'};
  }

  runFrame(job) {
    const structs_ = this.#structs, engine = this.#alive();
    ++this.#frame;
    return structs_.borrowed(() => {
      const {at, wantsContacts} = this.#frameJob(job);
      // Without room for a contact the engine would not see that any are wanted.
      if (wantsContacts && !this.#hits.room) this.#makeRoom(0);
      let code;
      do {
        this.#giveRoom(at, wantsContacts);
        code = this.#exports.cab_run_frame(engine, at);
      } while (code === enums.Status.values.hits_overflow &&
               this.#makeRoom(structs_.member('FrameJob', 'hitsNeeded', at)));
      structs_.check(code);
      return new Hits(structs_, this.#batches, {
        world: this,
        count: structs_.member('FrameJob', 'hitCount', at),
        at: this.#hits.at,
        contacts: wantsContacts ? this.#hits.contacts : 0,
        stats: structs_.get('FrameStats', at + structs.FrameJob.members.stats.at),
        isCurrent: ((frame) => () => frame === this.#frame)(this.#frame),
      });
    });
  }

  explainJob(job) {
    const structs_ = this.#structs, engine = this.#alive();
    return structs_.borrowed(() => {
      const {at, wantsContacts} = this.#frameJob(job);
      if (wantsContacts && !this.#hits.room) this.#makeRoom(0);
      this.#giveRoom(at, wantsContacts);
      const length = this.#exports.cab_explain_job(engine, at, structs_.spanAt(0, 0)) + 1;
      const text = structs_.take(length);
      this.#exports.cab_explain_job(engine, at, structs_.spanAt(text, length));
      return structs_.text(text);
    });
  }

  // -------------------------------------------------------------------------------------- what was found, looked at

  // Pairs of links, a list of hits, words of hits or hits as objects: their place in the module's memory, and a map of
  // the batches that their slots stand for, which may have been removed.
  #pairs(where, given) {
    const structs_ = this.#structs, pairs = structs_.lasting(given), list = pairs?.[HITS] ?? pairs;
    if (list instanceof Hits && list._world !== this) throw new TypeError(`cab: ${where} is of another world`);
    if (pairs instanceof Hits) return {place: pairs._place(), batches: pairs._batches};
    if (pairs instanceof Uint32Array) {
      const words = structs_.span(where, 'u32', pairs), perHit = structs.Hit.size / 4;
      if (words.size % perHit) throw new TypeError(`cab: ${where} has ${words.size} words, and not ${perHit} per hit`);
      const place = new Place(words.data, words.size / perHit);
      return {place, batches: list instanceof Hits ? list._batches : this.#knownBatches(where, place)};
    }
    if (typeof pairs?.[Symbol.iterator] !== 'function') throw new TypeError(`cab: ${where} is no list of hits`);
    const batches = new Map();
    const slotOf = (name, batch) => {
      if (!(batch instanceof Batch)) throw new TypeError(`cab: ${name} of ${where} is not what addBatch returns`);
      if (!this.#made.has(batch)) throw new TypeError(`cab: ${name} of ${where} is of another world`);
      const {slot} = batch;
      if (batches.has(slot) && batches.get(slot) !== batch) {
        throw new TypeError(`cab: ${where} has hits of two times: of a batch, and of one that took its slot`);
      }
      batches.set(slot, batch);
      return {value: slot};
    };
    const {data, size} = structs_.span(where, 'Hit', Array.from(pairs, (pair) => {
      const {  // of a pair, or of a hit
        batchA, instanceA, linkA, leafA = 0, batchB, instanceB, linkB, leafB = 0, contact, ...rest
      } = membersOf(`a pair of ${where}`, pair);
      refuseRest(`a pair of ${where}`, rest);
      return {
        batchA: slotOf('batchA', batchA), instanceA, linkA, leafA,
        batchB: slotOf('batchB', batchB), instanceB, linkB, leafB,
      };
    }));
    return {place: new Place(data, size), batches};
  }

  // The batches of words that do not know of which hits they are: of each slot the only one that there has been.
  #knownBatches(where, place) {
    for (const slot of this.#slotsOf(place)) {
      if (this.#onlyBatches.get(slot) !== null) continue;
      throw new TypeError(`cab: ${where} is a copy of words that names slot ${slot}, which several batches have had; ` +
                          'a copy by words().slice() knows which of them is meant');
    }
    return this.#onlyBatches;
  }

  // The slots of both batches of a hit.
  #slotsAt(hit) {
    const {batchA, batchB} = structs.Hit.members, {view} = this.#structs;
    return [view.getUint32(hit + batchA.at, true), view.getUint32(hit + batchB.at, true)];
  }

  #slotsOf({data, size}) {
    const slots = new Set();
    for (let i = 0; i < size; ++i) {
      for (const slot of this.#slotsAt(data + i * structs.Hit.size)) slots.add(slot);
    }
    return slots;
  }

  // The batches that pairs name, none of which may have been removed.
  #batchesOf(where, {place, batches}) {
    return Array.from(this.#slotsOf(place), (slot) => {
      const batch = batches.get(slot);
      if (!batch) throw new TypeError(`cab: ${where} names a batch that this world does not have`);
      if (batch.id === null) throw new TypeError(`cab: ${where} names a batch that has been removed`);
      return batch;
    });
  }

  // What call(inputs, pairs, size) answers for pairs of links, whose batches are its inputs.
  #ofPairs(where, pairs, call) {
    const structs_ = this.#structs;
    this.#alive();
    return structs_.borrowed(() => {
      const given = this.#pairs(where, pairs), {place} = given, batches = this.#batchesOf(where, given);
      const inputs = this.#inputs(batches.map(inputOf));
      return call(inputs, structs_.spanAt(place.data, place.size), place.size, batches);
    });
  }

  #inputs(inputs) {
    const {data, size} = this.#structs.span('batches', 'BatchInput', inputs);
    return this.#structs.spanAt(data, size);
  }

  computeContacts(pairs) {
    return this.#ofPairs('pairs', pairs, (inputs, span, count) => {
      const structs_ = this.#structs, {size} = structs.Contact, out = structs_.take(size * count);
      structs_.check(this.#exports.cab_compute_contacts(this.#engine, inputs, span, structs_.spanAt(out, count)));
      return Array.from({length: count}, (_, i) => structs_.get('Contact', out + i * size));
    });
  }

  findTouchingTriangles(pairs) {
    return this.#ofPairs('pairs', pairs, (inputs, span) => {
      const structs_ = this.#structs, found = structs_.take(4);
      ++this.#searched;
      let code, count;
      for (;;) {
        const out = structs_.spanAt(this.#triangles.at, this.#triangles.room);
        code = this.#exports.cab_find_touching_triangles(this.#engine, inputs, span, out, found);
        count = structs_.view.getUint32(found, true);
        if (code !== enums.Status.values.hits_overflow) break;
        const room = count + (count >> 1) + 64;
        this.#exports.free(this.#triangles.at);
        this.#triangles = {at: 0, room: 0};
        this.#triangles = {at: structs_.allocate(structs.TouchingTriangles.size * room), room};
      }
      structs_.check(code);
      return new TouchingTriangles(structs_, this.#batches, {
        count,
        at: this.#triangles.at,
        isCurrent: ((call) => () => call === this.#searched)(this.#searched),
      });
    });
  }

  diffHits(previous, current) {
    const structs_ = this.#structs;
    this.#alive();
    return structs_.borrowed(() => {
      const lasting = [previous, current].map((pairs) => structs_.lasting(pairs));
      const before = this.#pairs('previous', lasting[0]), now = this.#pairs('current', lasting[1]);
      const isOther = (slot) => before.batches.has(slot) && before.batches.get(slot) !== now.batches.get(slot);
      const others = before.batches === now.batches ? [] : [...this.#slotsOf(now.place)].filter(isOther);
      if (!others.length) return this.#changes(before, now);
      // Hits of a slot that stood for another batch are not the same, whatever their numbers.
      const without = ({place, batches}) => ({place: this.#without(place, new Set(others)), batches});
      return {began: this.#changes(without(before), now).began, ended: this.#changes(before, without(now)).ended};
    });
  }

  #changes(before, now) {
    const structs_ = this.#structs, {size} = structs.Hit;
    const began = structs_.take(size * now.place.size), ended = structs_.take(size * before.place.size);
    const changes = structs_.make('HitChanges', {
      began: new Place(began, now.place.size),
      ended: new Place(ended, before.place.size),
    });
    const spans = [before, now].map(({place}) => structs_.spanAt(place.data, place.size));
    structs_.check(this.#exports.cab_diff_hits(...spans, changes));
    const list = (at, length, {batches}) => Array.from({length}, (_, i) => {
      const hit = structs_.get('Hit', at + i * size);
      const [batchA, batchB] = [hit.batchA, hit.batchB].map(({value}) => {
        const batch = batches.get(value);
        return batch?.id ? batch : null;
      });
      return {...hit, batchA, batchB};
    });
    const count = (name) => structs_.member('HitChanges', name, changes);
    return {began: list(began, count('beganCount'), now), ended: list(ended, count('endedCount'), before)};
  }

  // A copy of hits without those that name one of the slots.
  #without({data, size: count}, slots) {
    const {size} = structs.Hit, at = this.#structs.take(size * count);
    const bytes = this.#structs.array('u8', 0, this.#structs.memory.buffer.byteLength);
    let kept = 0;
    for (let hit = data; hit < data + size * count; hit += size) {
      if (!this.#slotsAt(hit).some((slot) => slots.has(slot))) bytes.copyWithin(at + size * kept++, hit, hit + size);
    }
    return new Place(at, kept);
  }

  sweepMargins(last) {
    const structs_ = this.#structs, engine = this.#alive();
    return structs_.borrowed(() => {
      const [before, now] = [momentInput(structs_, last), inputOf(last.batch)].map(
          (input) => structs_.make('BatchInput', input));
      const {size} = last.batch, out = structs_.take(4 * size);
      structs_.array('f32', out, size).fill(0);
      structs_.check(this.#exports.cab_sweep_margins(engine, before, now, structs_.spanAt(out, size)));
      return structs_.array('f32', out, size).slice();
    });
  }

  findTouchingMoments(job) {
    const {last, pairs, resolution, ...rest} = membersOf('the job', job);
    refuseRest('findTouchingMoments', rest);
    if (typeof resolution !== 'number') throw new TypeError('cab: findTouchingMoments needs a resolution');
    return this.#ofPairs('pairs', pairs, (inputs, span, count, batches) => {
      const structs_ = this.#structs, out = structs_.take(4 * count);
      const still = batches.filter((batch) => !batch.articulation).map(inputOf);
      const before = this.#inputs([...still, ...last.map((moment) => momentInput(structs_, moment))]);
      structs_.check(this.#exports.cab_find_touching_moments(
          this.#engine, before, inputs, resolution, span, structs_.spanAt(out, count)));
      return structs_.array('f32', out, count).slice();
    });
  }

  boxLines(batch, options = {}) {
    const structs_ = this.#structs, engine = this.#alive(), input = inputOf(batch);
    const {
      policies = {}, level = 'leaves', shapes, hits = [], contacts, origin, ...rest
    } = membersOf('options of boxLines', options);
    refuseRest('boxLines', rest);
    return structs_.borrowed(() => {
      const drawn = structs_.read('BoxLinesJob', {
        level: level === 'leaves' ? LEAF_LEVEL : level,
        shapes,
        contacts,
        origin,
      });
      const marked = this.#pairs('hits', hits);
      this.#batchesOf('hits', marked);
      const job = structs_.make('BoxLinesJob', {...drawn, hits: marked.place});
      this.#setPolicies(job + structs.BoxLinesJob.members.policies.at, policies);
      const given = structs_.make('BatchInput', input), {size, members} = structs.BoxLine;
      let at = 0, code = this.#exports.cab_box_lines(engine, given, job);
      if (code === enums.Status.values.lines_overflow) {
        const room = structs_.member('BoxLinesJob', 'linesNeeded', job);
        at = structs_.take(size * room);
        structs_.set('BoxLinesJob', job, {lines: new Place(at, room)});
        code = this.#exports.cab_box_lines(engine, given, job);
      }
      structs_.check(code);
      const count = structs_.member('BoxLinesJob', 'lineCount', job), {view} = structs_;
      const lines = {
        count,
        positions: new Float32Array(6 * count),
        instances: new Uint32Array(count),
        nodes: new Uint16Array(count),
        links: new Uint16Array(count),
        isHit: new Uint8Array(count),
      };
      for (let i = 0, line = at; i < count; ++i, line += size) {
        lines.positions.set(structs_.array('f32', line + members.from.at, 3), 6 * i);
        lines.positions.set(structs_.array('f32', line + members.to.at, 3), 6 * i + 3);
        lines.instances[i] = view.getUint32(line + members.instance.at, true);
        lines.nodes[i] = view.getUint16(line + members.node.at, true);
        lines.links[i] = view.getUint16(line + members.link.at, true);
        lines.isHit[i] = view.getUint8(line + members.isHit.at);
      }
      return lines;
    });
  }

  spatialOrder(batch) {
    const structs_ = this.#structs, engine = this.#alive();
    if (!(batch instanceof Batch)) throw new TypeError('cab: the batch is not what addBatch returns');
    const id = structs_.idOf('the batch', batch);
    return structs_.borrowed(() => {
      const out = structs_.take(4 * batch.size);
      structs_.check(this.#exports.cab_spatial_order(engine, id, structs_.spanAt(out, batch.size)));
      return structs_.array('u32', out, batch.size).slice();
    });
  }

  addHistory(batch, ticks) {
    const id = this.#add((engine, desc, out) => this.#exports.cab_add_history(engine, desc, out), 'HistoryDesc',
                         () => ({batch, ticks}));
    return new History(this.#structs, () => this.#alive(), batch, id);
  }

  #setPolicies(at, policies) {
    if (typeof policies !== 'string') {
      this.#structs.set('Policies', at, policies);
      return;
    }
    const bytes = new TextEncoder().encode(policies + '\0');
    const name = this.#structs.take(bytes.length);
    this.#structs.array('u8', name, bytes.length).set(bytes);
    if (this.#exports.cab_preset_set(at, name)) return;
    throw new TypeError(`cab: there is no preset '${policies}'`);
  }

  #giveRoom(job, wantsContacts) {
    const {members} = structs.FrameJob, {at, contacts, room} = this.#hits;
    this.#structs.setSpan(job + members.hits.at, at, room);
    this.#structs.setSpan(job + members.contacts.at, wantsContacts ? contacts : 0, wantsContacts ? room : 0);
  }

  // Makes room for as many hits, and some more.
  #makeRoom(needed) {
    const room = needed + (needed >> 1) + 64;
    this.#exports.free(this.#hits.at);
    this.#exports.free(this.#hits.contacts);
    this.#hits = {at: 0, contacts: 0, room: 0};
    this.#hits.at = this.#structs.allocate(structs.Hit.size * room);
    this.#hits.contacts = this.#structs.allocate(structs.Contact.size * room);
    this.#hits.room = room;
    return true;
  }

  // --------------------------------------------------------------------------------------------------------- queries

  runQueries(job) {
    const structs_ = this.#structs, engine = this.#alive();
    const {
      queries = [], batches = Array.from(this.#batches.values()).filter((batch) => !batch._isSequence()),
      histories = [], exact, reuseBounds, surfacePoints = false, ...rest
    } = membersOf('the job', job);
    refuseRest('runQueries', rest);
    ++this.#asked;
    return structs_.borrowed(() => {
      const planes = [];
      const asked = queries.map((given) => {
        const members = membersOf('Query', given);
        if (!('planes' in members)) return members;  // as most are: a copy of each takes time
        const {planes: own, ...query} = members, firstPlane = planes.length;
        if (!own) return query;
        for (const plane of own) planes.push(plane);
        return {...query, firstPlane, planeCount: planes.length - firstPlane};
      });
      const at = structs_.make('QueryJob', {
        exact, reuseBounds, planes,
        inputs: batches.map(inputOf),
        histories,
        queries: asked,
        badQuery: asked.length,
      });
      const found = structs_.take(Math.max(asked.length, 1));
      structs_.set('QueryJob', at, {found: new Place(found, asked.length)});
      const {hits, surfacePoints: points} = structs.QueryJob.members;
      let code;
      for (;;) {
        structs_.setSpan(at + hits.at, this.#found.at, this.#found.room);
        if (surfacePoints) structs_.setSpan(at + points.at, this.#found.points, this.#found.room);
        code = this.#exports.cab_run_queries(engine, at);
        if (code === enums.Status.values.no_query_memory) {
          structs_.check(this.#exports.cab_reserve(engine, structs_.make('ReserveDesc', {queries: 256})));
        } else if (code === enums.Status.values.hits_overflow) {
          const needed = structs_.member('QueryJob', 'hitsNeeded', at), room = needed + (needed >> 1) + 64;
          for (const kept of [this.#found.at, this.#found.points]) this.#exports.free(kept);
          this.#found = {at: 0, points: 0, room: 0};
          this.#found.at = structs_.allocate(structs.QueryHit.size * room);
          this.#found.points = structs_.allocate(structs.SurfacePoint.size * room);
          this.#found.room = room;
        } else {
          break;
        }
      }
      const bad = structs_.member('QueryJob', 'badQuery', at);
      structs_.check(code, bad < asked.length ? bad : undefined);
      return new QueryHits(structs_, this.#batches, {
        count: structs_.member('QueryJob', 'hitCount', at),
        at: this.#found.at,
        points: surfacePoints ? this.#found.points : 0,
        found: structs_.array('u8', found, asked.length).slice(),
        stats: structs_.get('QueryStats', at + structs.QueryJob.members.stats.at),
        isCurrent: ((call) => () => call === this.#asked)(this.#asked),
      });
    });
  }
}

// ------------------------------------------------------------------------------------------------------------- hits

// A list of structs that the engine wrote, until it writes the next one.
class List {
  #isCurrent;

  constructor(structs_, batches, {name, count, at, stats, isCurrent}) {
    this._structs = structs_;
    this._batches = batches;
    this._name = name;
    this._at = at;
    this.#isCurrent = isCurrent;
    this.length = count;
    this.stats = stats;
  }

  _isCurrent() { return this.#isCurrent(); }

  _alive() {
    if (this.#isCurrent()) return;
    throw new Error('cab: these hits have been replaced by those of a later call; toArray() keeps hits');
  }

  // The address of entry i.
  _entry(i, name = this._name, from = this._at) {
    this._alive();
    if (!(Number.isInteger(i) && i >= 0 && i < this.length)) throw new RangeError(`cab: there is no hit ${i}`);
    return from + i * structs[name].size;
  }

  _member(i, key) { return this._structs.member(this._name, key, this._entry(i)); }

  _u32(i, key) { return this._structs.view.getUint32(this._entry(i) + structs[this._name].members[key].at, true); }

  _u16(i, key) { return this._structs.view.getUint16(this._entry(i) + structs[this._name].members[key].at, true); }

  words() {
    if (!this.length) return new Uint32Array(0);
    return this._structs.lend('words()', 'u32', this._entry(0), this.length * this.wordsPerHit, this);
  }

  get wordsPerHit() { return structs[this._name].size / 4; }

  // Where all entries are.
  _place() { return new Place(this.length ? this._entry(0) : 0, this.length); }

  at(i) { return this._object(i); }

  toArray() { return Array.from(this); }

  * [Symbol.iterator]() {
    for (let i = 0; i < this.length; ++i) yield this._object(i);
  }
}

// What has the hits that words are of.
const HITS = Symbol('hits');

// Words that know of which hits they are, and so do their parts and copies: a slot may stand for another batch later.
function wordsOf(list, words) {
  const part = (name) => ({
    configurable: true,  // else a checked view could not have its own
    value(...range) {
      const words = Uint32Array.prototype[name].apply(this, range);
      // A view that was kept may show hits of a later frame by now.
      const isLate = this.buffer === list._structs.memory.buffer && !list._isCurrent();
      return isLate ? words : wordsOf(list, words);
    },
  });
  return Object.defineProperties(words, {[HITS]: {value: list}, slice: part('slice'), subarray: part('subarray')});
}

export class Hits extends List {
  #contacts;

  constructor(structs_, batches, values) {
    super(structs_, batches, {...values, name: 'Hit'});
    this._world = values.world;
    this.#contacts = values.contacts;
  }

  words() { return wordsOf(this, super.words()); }

  batchA(i) { return this._batches.get(this._u32(i, 'batchA')); }
  batchB(i) { return this._batches.get(this._u32(i, 'batchB')); }
  instanceA(i) { return this._u32(i, 'instanceA'); }
  instanceB(i) { return this._u32(i, 'instanceB'); }
  linkA(i) { return this._u16(i, 'linkA'); }
  linkB(i) { return this._u16(i, 'linkB'); }
  leafA(i) { return this._u16(i, 'leafA'); }
  leafB(i) { return this._u16(i, 'leafB'); }

  contact(i) {
    if (!this.#contacts) throw new TypeError('cab: the frame was not asked for contacts');
    return this._structs.get('Contact', this._entry(i, 'Contact', this.#contacts));
  }

  contactWords() {
    if (!this.#contacts) throw new TypeError('cab: the frame was not asked for contacts');
    if (!this.length) return new Uint32Array(0);
    const at = this._entry(0, 'Contact', this.#contacts);
    return this._structs.lend('contactWords()', 'u32', at, this.length * this.wordsPerContact, this);
  }

  get wordsPerContact() { return structs.Contact.size / 4; }

  depth(i) {
    if (!this.#contacts) throw new TypeError('cab: the frame was not asked for contacts');
    return this._structs.member('Contact', 'depth', this._entry(i, 'Contact', this.#contacts));
  }

  _object(i) {
    const hit = {
      batchA: this.batchA(i), instanceA: this.instanceA(i), linkA: this.linkA(i), leafA: this.leafA(i),
      batchB: this.batchB(i), instanceB: this.instanceB(i), linkB: this.linkB(i), leafB: this.leafB(i),
    };
    if (this.#contacts) hit.contact = this.contact(i);
    return hit;
  }
}

export class TouchingTriangles extends List {
  constructor(structs_, batches, values) { super(structs_, batches, {...values, name: 'TouchingTriangles'}); }

  _object(i) { return this._structs.get('TouchingTriangles', this._entry(i)); }
}

export class QueryHits extends List {
  #points;

  constructor(structs_, batches, values) {
    super(structs_, batches, {...values, name: 'QueryHit'});
    this.found = values.found;
    this.#points = values.points;
  }

  surfacePoint(i) {
    if (!this.#points) throw new TypeError('cab: the queries were not asked for surfacePoints');
    const point = this._structs.get('SurfacePoint', this._entry(i, 'SurfacePoint', this.#points));
    return point.triangle === NO_TRIANGLE ? null : point;
  }

  _object(i) {
    const hit = this._structs.get('QueryHit', this._entry(i));
    hit.batch = this._batches.get(hit.batch.value);
    if (this.#points) hit.surfacePoint = this.surfacePoint(i);
    return hit;
  }
}
