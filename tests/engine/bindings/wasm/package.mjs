// The package that the tests are of, in the folder that CAB_PACKAGE names.
import {pathToFileURL} from 'node:url';

export const folder = process.env.CAB_PACKAGE;
export const cab = await import(pathToFileURL(`${folder}/index.js`));
export const abi = await import(pathToFileURL(`${folder}/abi.js`));

// Boxes half a unit thick along x.
export const bone = {center: [0.5, 0, 0], axis: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], half: [0.5, 0.125, 0.125]};

// A chain of links with a box each.
export function chain(links, more = {}) {
  const all = Array.from({length: links}, (_, link) => link);
  return {linkParents: all.map((link) => link - 1), leaves: all.map((link) => ({link, box: bone})), ...more};
}

// Multiples of 2^-15 from -1 to 1.
export class Numbers {
  constructor(state) { this.state = state; }
  next() {
    this.state = (Math.imul(this.state, 1664525) + 1013904223) >>> 0;
    return ((this.state >>> 16) - 32768) / 32768;
  }
}

// FNV-1a of words, their lowest byte first, in two halves of 32 bits.
export class Hash {
  #bits = new DataView(new ArrayBuffer(4));
  high = 0xcbf29ce4;
  low = 0x84222325;
  add(word) {
    for (let shift = 0; shift < 32; shift += 8) {
      const low = (this.low ^ ((word >>> shift) & 0xff)) >>> 0;
      // Times 2^40 + 0x1b3.
      const product = low * 0x1b3;
      this.high = (Math.imul(this.high, 0x1b3) + Math.floor(product / 2 ** 32) + (low << 8)) >>> 0;
      this.low = product >>> 0;
    }
  }
  addFloats(...numbers) {
    for (const number of numbers) {
      this.#bits.setFloat32(0, number);
      this.add(this.#bits.getUint32(0));
    }
  }
  toString() { return [this.high, this.low].map((half) => half.toString(16).padStart(8, '0')).join(''); }
}
