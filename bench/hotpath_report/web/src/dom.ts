// SPDX-License-Identifier: Apache-2.0
// Elements, numbers and colours. Names from runs only ever become text nodes and attribute values.

type Child = Node | string | null;
export type Attributes = Record<string, string | number | boolean | ((event: never) => void)>;

function fill<E extends Element>(element: E, attributes: Attributes, children: Child[]): E {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else if (value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((c): c is Node | string => c !== null));
  return element;
}

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  return fill(document.createElement(tag), attributes, children);
}

export function svg(tag: string, attributes: Attributes = {}, ...children: Child[]): SVGElement {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

/** A line with the colour and dash of a curve, for legends. */
export function swatch({ colour, dash }: { colour: string; dash: number[] }): SVGElement {
  const line = svg("line", { x1: 0, y1: 5, x2: 26, y2: 5, stroke: colour, "stroke-width": 2.5, "stroke-dasharray": dash.join(" ") || "none" });
  return svg("svg", { width: 26, height: 10, "aria-hidden": "true", class: "swatch" }, line);
}

/** A choice with its label. */
export class Choice {
  readonly element: HTMLElement;
  readonly select: HTMLSelectElement;

  constructor(id: string, label: string, changed: () => void, ...beside: Child[]) {
    this.select = h("select", { id, change: changed });
    this.element = h("div", { class: "controls" }, h("label", { for: id }, label), this.select, ...beside);
  }

  get value(): string {
    return this.select.value;
  }

  /** Offers other options, (value, text); the chosen one stays if it is one of them. */
  offer(options: [number | string, string][]): this {
    const kept = this.value;
    this.select.replaceChildren(...options.map(([value, text]) => h("option", { value }, text)));
    this.select.value = kept;
    if (this.select.selectedIndex < 0) this.select.selectedIndex = 0;
    return this;
  }
}

/** A table that scrolls within its region of the page. */
export function table(label: string, header: string[], body: HTMLElement, more = ""): HTMLElement {
  const head = h("thead", {}, h("tr", {}, ...header.map((text) => h("th", { scope: "col" }, text))));
  return h("div", { class: `scroll${more}`, tabindex: 0, role: "region", "aria-label": label }, h("table", { class: "data" }, head, body));
}

export const NS_PER_MS = 1e6;
export const NS_PER_S = 1e9;

/** Milliseconds with the digits that jobs.csv resolves in a tooltip or table. */
export function ms(ns: number): string {
  return (ns / NS_PER_MS).toFixed(3);
}

export function seconds(ns: number): string {
  return `${(ns / NS_PER_S).toFixed(6)} s`;
}

/** Value of one of the page's CSS variables, which follow its light or dark theme. */
export function theme(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Calls `redraw` when the theme changes, or the width of an element is not the one for which it was drawn. */
export function onLook(element: Element, drawn: () => number | undefined, redraw: () => void): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(() => {
    const width = Math.floor(element.clientWidth);
    if (width > 0 && width !== drawn()) redraw();
  }).observe(element);
}
