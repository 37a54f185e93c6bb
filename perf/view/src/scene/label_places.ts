// Where labels stand, so that none is over another one.

/** The point that a label is about, and its size. */
export interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Place {
  /** Its upper left corner. */
  x: number;
  y: number;
}

/** From the point to the label. */
const GAP = 8;
/** How many rows of labels away from its point one may stand. */
const ROWS_AWAY = 6;

/**
 * Places labels in their order: each as near to its point as it can be without overlap, within the picture. Null: there
 * is no room.
 */
export function placeBoxes(boxes: readonly Box[], width: number, height: number): (Place | null)[] {
  const placed: (Place & Pick<Box, 'width' | 'height'>)[] = [];
  return boxes.map((box) => {
    for (const {x, y} of candidates(box)) {
      const place = {x, y, width: box.width, height: box.height};
      if (x < 0 || y < 0 || x + box.width > width || y + box.height > height) continue;
      if (placed.some((other) => overlap(place, other))) continue;
      placed.push(place);
      return {x, y};
    }
    return null;
  });
}

// Above and to the right first, then around, then farther up and down.
function* candidates({x, y, width, height}: Box): Generator<Place> {
  for (let row = 0; row < ROWS_AWAY; ++row) {
    const away = row * (height + 2);
    for (const top of [y - GAP - height - away, y + GAP + away]) {
      for (const left of [x + GAP, x - GAP - width, x - width / 2]) yield {x: left, y: top};
    }
  }
}

const overlap = (a: Place & {width: number; height: number}, b: Place & {width: number; height: number}): boolean =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
