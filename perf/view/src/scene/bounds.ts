// An axis-aligned box about what is drawn, relative to the scene's centre.

export class Bounds {
  readonly low = [Infinity, Infinity, Infinity];
  readonly high = [-Infinity, -Infinity, -Infinity];

  get empty(): boolean {
    return !(this.low[0]! <= this.high[0]!);
  }

  addPoint(x: number, y: number, z: number): void {
    [x, y, z].forEach((value, k) => {
      if (value < this.low[k]!) this.low[k] = value;
      if (value > this.high[k]!) this.high[k] = value;
    });
  }

  /** Adds the box of half extents `half` that rows place. */
  addRows(rows: Float32Array, at: number, half: readonly [number, number, number]): void {
    for (let k = 0; k < 3; ++k) {
      const row = at + k * 4;
      const reach = Math.abs(rows[row]!) * half[0] + Math.abs(rows[row + 1]!) * half[1] +
          Math.abs(rows[row + 2]!) * half[2];
      const middle = rows[row + 3]!;
      if (middle - reach < this.low[k]!) this.low[k] = middle - reach;
      if (middle + reach > this.high[k]!) this.high[k] = middle + reach;
    }
  }

  add(other: Bounds): void {
    if (other.empty) return;
    this.addPoint(other.low[0]!, other.low[1]!, other.low[2]!);
    this.addPoint(other.high[0]!, other.high[1]!, other.high[2]!);
  }

  center(): [number, number, number] {
    return [0, 1, 2].map((k) => (this.low[k]! + this.high[k]!) / 2) as [number, number, number];
  }

  size(k: number): number {
    return this.empty ? 0 : this.high[k]! - this.low[k]!;
  }

  get radius(): number {
    return Math.hypot(this.size(0), this.size(1), this.size(2)) / 2;
  }
}

