// CRC-32 as zlib has it, eight bytes at a time.

const POLYNOMIAL = 0xedb88320;

// Entry 256 * k + b is the remainder of byte b with k zero bytes behind it.
function makeTable(): Uint32Array {
  const table = new Uint32Array(8 * 256);
  for (let byte = 0; byte < 256; ++byte) {
    let rest = byte;
    for (let bit = 0; bit < 8; ++bit) rest = rest & 1 ? (rest >>> 1) ^ POLYNOMIAL : rest >>> 1;
    table[byte] = rest;
  }
  for (let at = 256; at < table.length; ++at) {
    const before = table[at - 256]!;
    table[at] = (before >>> 8) ^ table[before & 0xff]!;
  }
  return table;
}

const TABLE = makeTable();

function byBytes(rest: number, bytes: Uint8Array, begin: number, end: number): number {
  for (let at = begin; at < end; ++at) rest = (rest >>> 8) ^ TABLE[(rest ^ bytes[at]!) & 0xff]!;
  return rest;
}

export function crc32(bytes: Uint8Array): number {
  const aligned = Math.min(-bytes.byteOffset & 3, bytes.length);
  const pairs = (bytes.length - aligned) >>> 3;
  let rest = byBytes(0xffffffff, bytes, 0, aligned);
  if (pairs > 0) {
    const words = new Uint32Array(bytes.buffer, bytes.byteOffset + aligned, 2 * pairs);
    for (let at = 0; at < words.length; at += 2) {
      const low = words[at]! ^ rest, high = words[at + 1]!;
      rest = TABLE[1792 + (low & 0xff)]! ^ TABLE[1536 + ((low >>> 8) & 0xff)]! ^
          TABLE[1280 + ((low >>> 16) & 0xff)]! ^ TABLE[1024 + (low >>> 24)]! ^ TABLE[768 + (high & 0xff)]! ^
          TABLE[512 + ((high >>> 8) & 0xff)]! ^ TABLE[256 + ((high >>> 16) & 0xff)]! ^ TABLE[high >>> 24]!;
    }
  }
  return (byBytes(rest, bytes, aligned + 8 * pairs, bytes.length) ^ 0xffffffff) >>> 0;
}
