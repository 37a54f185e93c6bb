// Files that the page makes: pictures, films and markers.
import {el} from './dom.js';

/** Hands a file to the browser, which saves it or asks where. */
export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  const link = el('a', {href: address, download: name, hidden: true});
  document.body.append(link);
  link.click();
  link.remove();
  // The browser has begun to read it by then.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** A title as the beginning of a file's name. */
export const fileName = (title: string): string =>
  title.replace(/[^\p{L}\p{N}._-]+/gu, '_').slice(0, 80) || 'recording';
