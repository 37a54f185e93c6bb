// Makes elements of the page.

type Value = string | number | boolean | ((event: Event) => void);

/**
 * An element with attributes, listeners and children. A boolean sets or leaves out an attribute; a function listens to
 * the event of its name.
 */
export function el<K extends keyof HTMLElementTagNameMap>(
    tag: K, attributes: Readonly<Record<string, Value>> = {}, ...children: readonly (Node | string)[]):
    HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') {
      element.addEventListener(name, value);
    } else if (typeof value === 'boolean') {
      element.toggleAttribute(name, value);
    } else {
      element.setAttribute(name, String(value));
    }
  }
  element.append(...children);
  return element;
}

/** An element of a drawing, with attributes and children. */
export function svg(tag: string, attributes: Readonly<Record<string, string | number>>,
                    ...children: readonly (Node | string)[]): SVGElement {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag) as SVGElement;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** Writes a text, if it is another one. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A drawing surface whose pixels are the screen's, with a size in CSS pixels. Null if the canvas has no size. */
export function prepareCanvas(canvas: HTMLCanvasElement): {context: CanvasRenderingContext2D; width: number;
                                                           height: number} | null {
  const {clientWidth: width, clientHeight: height} = canvas;
  const ratio = window.devicePixelRatio || 1;
  const context = canvas.getContext('2d');
  if (!context || width === 0 || height === 0) return null;
  const pixels = {width: Math.round(width * ratio), height: Math.round(height * ratio)};
  if (canvas.width !== pixels.width || canvas.height !== pixels.height) Object.assign(canvas, pixels);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return {context, width, height};
}
