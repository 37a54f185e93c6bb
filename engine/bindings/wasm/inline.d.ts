/** `cab-collision` with the module in the JavaScript itself: no file to serve, and no recipe for a bundler. */
export * from './index.js';
import type {Cab, CheckOptions} from './index.js';

/**
 * Makes a module with a memory of its own, of up to 2 GB. It has SIMD: throws an Error where SIMD, or the
 * decompression of `DecompressionStream`, does not run.
 */
export declare function load(options?: CheckOptions): Promise<Cab>;
