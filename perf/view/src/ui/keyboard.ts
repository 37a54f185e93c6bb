// Keys of the viewer. KEYS is also what the help shows.

export interface KeyActions {
  toggle: () => void;
  step: (by: number) => void;
  jump: (forward: boolean) => void;
  first: () => void;
  last: () => void;
  level: (level: number) => void;
  boxes: () => void;
  contacts: () => void;
  falsePositives: () => void;
  follow: () => void;
  fit: () => void;
  clear: () => void;
  help: () => void;
}

export const KEYS: readonly (readonly [keys: string, meaning: string])[] = [
  ['Space', 'play or pause'],
  ['\u2190 \u2192', 'one frame back or on'],
  ['Shift \u2190 \u2192', 'previous or next contact, of the selected pair if there is one'],
  ['Home, End', 'first or last frame'],
  ['1 to 9', 'inner boxes of that level of the tree; 0 for none'],
  ['b', 'leaf boxes'],
  ['c', 'contacts'],
  ['p', 'false positives'],
  ['f', 'follow the selected character'],
  ['z', 'fit the camera to what is selected, or to everything'],
  ['Escape', 'nothing is selected'],
  ['?', 'this help'],
];

// Where keys mean something else.
const takesKeys = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement && (target.matches('input, select, textarea') || target.isContentEditable);

/** Listens until the signal is aborted, while what the keys act on is seen. */
export function listenToKeys(actions: KeyActions, isSeen: () => boolean, signal: AbortSignal): void {
  const act = (event: KeyboardEvent): boolean => {
    const {key, shiftKey} = event;
    const onButton = event.target instanceof HTMLElement && event.target.matches('button, summary, a');
    switch (key) {
      case ' ':
        if (onButton) return false;
        actions.toggle();
        return true;
      case 'ArrowLeft':
      case 'ArrowRight':
        if (shiftKey) actions.jump(key === 'ArrowRight');
        else actions.step(key === 'ArrowRight' ? 1 : -1);
        return true;
      case 'Home':
        actions.first();
        return true;
      case 'End':
        actions.last();
        return true;
      case 'b':
        actions.boxes();
        return true;
      case 'c':
        actions.contacts();
        return true;
      case 'p':
        actions.falsePositives();
        return true;
      case 'f':
        actions.follow();
        return true;
      case 'z':
        actions.fit();
        return true;
      case '?':
        actions.help();
        return true;
      case 'Escape':
        actions.clear();
        return true;
    }
    if (/^[0-9]$/.test(key)) {
      actions.level(Number(key));
      return true;
    }
    return false;
  };
  document.addEventListener('keydown', (event) => {
    const modified = event.ctrlKey || event.metaKey || event.altKey;
    if (modified || event.defaultPrevented || takesKeys(event.target)) return;
    if (!isSeen() || document.querySelector('dialog[open]')) return;
    if (act(event)) event.preventDefault();
  }, {signal});
}
