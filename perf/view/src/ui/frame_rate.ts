// How many pictures were drawn in the last second.
export class FrameRate {
  #times: number[] = [];

  add(now: number): void {
    this.#times.push(now);
    while (this.#times[0]! < now - 1000) this.#times.shift();
  }

  perSecond(now: number): number {
    const recent = this.#times.filter((time) => time >= now - 1000);
    const first = recent[0];
    if (first === undefined || recent.length < 2) return 0;
    return (recent.length - 1) / (recent[recent.length - 1]! - first) * 1000;
  }
}
