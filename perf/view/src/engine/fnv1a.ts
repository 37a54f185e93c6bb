// FNV-1a of 64 bits, in two halves of 32: numbers of JavaScript hold no product of 64 bits.

// The prime is 2^40 + 0x1b3.
const PRIME_LOW = 0x1b3;

export class Fnv1a {
  #high = 0xcbf29ce4 | 0;
  #low = 0x84222325 | 0;

  add(bytes: Uint8Array): void {
    let high = this.#high, low = this.#low;
    for (let at = 0; at < bytes.length; ++at) {
      low ^= bytes[at]!;
      const first = (low & 0xffff) * PRIME_LOW;
      const second = (low >>> 16) * PRIME_LOW + (first >>> 16);
      high = (Math.imul(high, PRIME_LOW) + (second >>> 16) + (low << 8)) | 0;
      low = (second << 16) | (first & 0xffff);
    }
    this.#high = high;
    this.#low = low;
  }

  get hash(): bigint { return BigInt(this.#high >>> 0) << 32n | BigInt(this.#low >>> 0); }
}

/** The hash of a frame: of the bytes of its hits, then of its contacts. */
export function hashOfHits(hits: Uint32Array, contacts: Float32Array | null): bigint {
  const hash = new Fnv1a();
  for (const list of [hits, contacts]) {
    if (list !== null) hash.add(new Uint8Array(list.buffer, list.byteOffset, list.byteLength));
  }
  return hash.hash;
}
