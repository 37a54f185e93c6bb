// Tabs: one panel at a time, chosen by press or by arrow keys.
import {el} from '../ui/dom.js';

export interface Tab {
  readonly name: string;
  readonly panel: HTMLElement;
}

let made = 0;

export function makeTabs(label: string, tabs: readonly Tab[]): HTMLElement {
  const id = `report-tabs-${made++}`;
  const choose = (index: number): void => {
    buttons.forEach((button, at) => {
      button.setAttribute('aria-selected', String(at === index));
      button.tabIndex = at === index ? 0 : -1;
    });
    panels.forEach((panel, at) => { panel.hidden = at !== index; });
  };
  const buttons = tabs.map(({name}, index) => el('button', {
    type: 'button', role: 'tab', id: `${id}-tab-${index}`, 'aria-controls': `${id}-panel-${index}`,
    click: () => choose(index),
  }, name));
  const panels = tabs.map(({panel}, index) => el('div', {
    role: 'tabpanel', id: `${id}-panel-${index}`, 'aria-labelledby': `${id}-tab-${index}`,
  }, panel));
  const bar = el('div', {role: 'tablist', 'aria-label': label, class: 'report-tabs'}, ...buttons);
  bar.addEventListener('keydown', (event) => {
    const by = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    const at = buttons.findIndex((button) => button === event.target);
    if (by === 0 || at < 0) return;
    event.preventDefault();
    event.stopPropagation();
    const next = (at + by + buttons.length) % buttons.length;
    choose(next);
    buttons[next]?.focus();
  });
  choose(0);
  return el('div', {class: 'report-tabbed'}, bar, ...panels);
}
