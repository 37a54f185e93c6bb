// Numbers as people read them.

export const count = (value: number): string =>
  value < 1e9 ? value.toLocaleString('en-GB').replaceAll(',', '\u202f') : value.toExponential(2).replace('e+', 'e');

export const milliseconds = (value: number): string =>
  value >= 100 ? `${value.toFixed(0)} ms` : value >= 1 ? `${value.toFixed(1)} ms` : `${value.toFixed(3)} ms`;

export const seconds = (value: number): string => `${value.toFixed(2)} s`;

/** A duration that is about to pass. */
export function timeLeft(value: number): string {
  if (value < 1) return 'less than a second left';
  if (value < 90) return `${Math.ceil(value)} s left`;
  return `${Math.ceil(value / 60)} minutes left`;
}

/** 64 bits in hexadecimal digits. */
export const hash = (value: bigint): string => value.toString(16).padStart(16, '0');

/** A length with three digits that count; in millimetres or metres where the unit is known. */
export function length(value: number, metresPerUnit: number): string {
  if (metresPerUnit <= 0) return value.toPrecision(3);
  const metres = value * metresPerUnit;
  return Math.abs(metres) < 1 ? `${(metres * 1000).toPrecision(3)} mm` : `${metres.toPrecision(3)} m`;
}

/** How deep links are in each other; below 0, how far apart they are. */
export const depthText = (depth: number, metresPerUnit: number): string =>
  `${length(Math.abs(depth), metresPerUnit)} ${depth < 0 ? 'apart' : 'deep'}`;

export const plural = (value: number, one: string, many = `${one}s`): string =>
  `${count(value)} ${value === 1 ? one : many}`;

export const wordsOf = (error: unknown): string => error instanceof Error ? error.message : String(error);
