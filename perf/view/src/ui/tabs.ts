// Tabs, of which one panel is shown.
import {el} from './dom.js';

let made = 0;

export function makeTabs(panels: readonly (readonly [title: string, panel: HTMLElement])[]): HTMLElement {
  const set = made++;
  const tabs = panels.map(([title, panel], i) => {
    panel.id ||= `cab-panel-${set}-${i}`;
    return el('button', {
      type: 'button', role: 'tab', id: `cab-tab-${set}-${i}`, 'aria-controls': panel.id, click: () => show(i),
    }, title);
  });
  const show = (shown: number): void => {
    tabs.forEach((tab, i) => {
      tab.setAttribute('aria-selected', String(i === shown));
      tab.tabIndex = i === shown ? 0 : -1;
    });
    panels.forEach(([, panel], i) => (panel.hidden = i !== shown));
  };
  const list = el('div', {
    class: 'tab-list', role: 'tablist',
    keydown: (event) => {
      const {key} = event as KeyboardEvent;
      const at = tabs.findIndex((tab) => tab === document.activeElement);
      if (at < 0 || (key !== 'ArrowLeft' && key !== 'ArrowRight')) return;
      event.preventDefault();
      const next = (at + (key === 'ArrowRight' ? 1 : tabs.length - 1)) % tabs.length;
      show(next);
      tabs[next]!.focus();
    },
  }, ...tabs);
  panels.forEach(([, panel], i) => {
    panel.setAttribute('role', 'tabpanel');
    panel.setAttribute('aria-labelledby', `cab-tab-${set}-${i}`);
  });
  show(0);
  return el('div', {class: 'tabs'}, list, ...panels.map(([, panel]) => panel));
}
