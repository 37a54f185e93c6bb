// The report that `cab report` writes into the page, as JSON. docs/report.md says what each number means.

/** A link of a recording: slot of the batch as hits have it, instance, link. */
export type LinkRef = readonly [slot: number, instance: number, link: number];

/** Two links of a recording, in the order of its hits. */
export interface PairRef {
  readonly a: LinkRef;
  readonly b: LinkRef;
}

export interface ReportFile {
  readonly name: string;
  readonly title: string;
  /** Index of the embedded recording, or null. */
  readonly recording: number | null;
  readonly frames: number;
  /** Those that could be read. */
  readonly frames_read: number;
  /** 0: unknown. */
  readonly seconds_per_frame: number;
  /** 0: unknown; then depths are in the unit of the recording. Else they are in metres. */
  readonly metres_per_unit: number;
  readonly problems: readonly string[];
}

/** Whose contact a row is. */
export interface RowLinks extends PairRef {
  /** Index of the file. */
  readonly file: number;
  readonly character_a: string;
  readonly link_a: string;
  readonly character_b: string;
  readonly link_b: string;
}

/** What rows of intervals and of pairs have in common. */
export interface Row extends RowLinks {
  readonly frames: number;
  /** Null: none is known. */
  readonly worst_depth: number | null;
  /** Pairs of triangles of skins that touch in the worst frame. Null: none. */
  readonly worst_triangles: number | null;
  readonly worst_frame: number;
  /** Where that is in the world, in the unit of depths. Null: it is not known. */
  readonly worst_point: readonly [x: number, y: number, z: number] | null;
  /** Null: the recording has no time there. */
  readonly worst_seconds: number | null;
}

export interface ReportInterval extends Row {
  readonly first: number;
  readonly last: number;
  readonly first_seconds: number | null;
  readonly last_seconds: number | null;
}

export interface ReportPair extends Row {
  readonly share: number;
  readonly intervals: number;
  /** Frames of the longest interval. */
  readonly longest: number;
}

export interface Report {
  readonly version: string;
  readonly files: readonly ReportFile[];
  /** The worst ones, worst first. */
  readonly intervals: readonly ReportInterval[];
  /** Likewise. */
  readonly pairs: readonly ReportPair[];
  /** How many there are, also where the page does not hold them. */
  readonly interval_count: number;
  readonly pair_count: number;
  /** Filters of the command: what is less deep or shorter is in none of the rows. Null: no filter. */
  readonly min_depth: number | null;
  readonly min_frames: number;
  /** Name of the CSV file that has all intervals. Empty: there is none. */
  readonly csv: string;
}

/** A picture of a row at its worst frame, as an address for an image. Rejects if there is none. */
export type PictureOf = (row: Row) => Promise<string>;

/** The same of an embedded recording. */
export type PictureOfRecording = (recording: number, frame: number, pair: PairRef) => Promise<string>;

/** Opens an embedded recording at a frame, with a pair of links selected. */
export type OpenRecording = (recording: number, frame: number, pair: PairRef) => void;
