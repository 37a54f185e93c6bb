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
