// SPDX-License-Identifier: Apache-2.0
// The graph of a run, coloured by the selected chain, task and output.

import type { Output, Run, Series } from "./data";
import { h, svg } from "./dom";

const BOX = { width: 150, height: 26, dx: 190, dy: 40 };

export class GraphView {
  readonly element = h("section", { class: "graph", "aria-label": "Graph" });
  private readonly place = h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Picture of the graph" });
  private readonly text = h("p", { class: "faint small" });

  constructor() {
    this.element.append(h("h3", {}, "Graph"), this.text, this.place);
  }

  show(run: Run, series: Series, target: { kind: string; name: string }, output: Output | null, pathColour: string): void {
    const { graph } = run;
    this.element.hidden = !graph;
    if (!graph) return;
    const nodesOf = (tasks: number[]): Set<number> => new Set(tasks.map((t) => graph.node_of_task[t]));
    const chain = graph.chains.find((c) => c.name === target.name)?.tasks;
    const selected = nodesOf(chain ?? [run.tasks.indexOf(target.name)]);
    const path = (output?.path ?? []).map(([task]) => graph.node_of_task[task]);
    const behind = nodesOf((output?.parts ?? []).map((p) => p.behind).filter((t) => t >= 0));
    const top = Math.min(...graph.nodes.map((n) => n.row));
    const x = (n: number): number => graph.nodes[n].column * BOX.dx + 8;
    const y = (n: number): number => (graph.nodes[n].row - top) * BOX.dy + 8;
    const lines = graph.edges.map(([a, b]) => {
      const hops = path.findIndex((n, k) => n === a && path[k + 1] === b) >= 0;
      const kind = hops ? "hop" : selected.has(a) && selected.has(b) ? "chosen" : "edge";
      const [x0, y0, x1, y1] = [x(a) + BOX.width, y(a) + BOX.height / 2, x(b), y(b) + BOX.height / 2];
      const d = `M${x0},${y0} C${x0 + 24},${y0} ${x1 - 24},${y1} ${x1},${y1}`;
      return svg("path", { d, class: kind, "marker-end": "url(#hotpath-arrow)" });
    });
    const boxes = graph.nodes.map((node, n) => {
      const kind = path.includes(n) ? "hop" : behind.has(n) ? "behind" : selected.has(n) ? "chosen" : "node";
      const name = node.name.length > 22 ? `${node.name.slice(0, 21)}…` : node.name;
      return svg("g", { class: kind, transform: `translate(${x(n)},${y(n)})` },
        svg("title", {}, `${node.name} (${node.type})`),
        svg("rect", { width: BOX.width, height: BOX.height, rx: 5 }),
        svg("text", { x: BOX.width / 2, y: BOX.height / 2 + 4 }, name));
    });
    const arrow = svg("marker", { id: "hotpath-arrow", viewBox: "0 0 6 6", refX: 6, refY: 3, markerWidth: 6, markerHeight: 6, orient: "auto" },
      svg("path", { d: "M0,0 L6,3 L0,6 z" }));
    const width = Math.max(...graph.nodes.map((_, n) => x(n))) + BOX.width + 8;
    const height = Math.max(...graph.nodes.map((_, n) => y(n))) + BOX.height + 8;
    const picture = svg("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": this.words(run, path, behind, selected) },
      svg("defs", {}, arrow), ...lines, ...boxes);
    picture.style.setProperty("--series", series.colour);
    picture.style.setProperty("--path", pathColour);
    this.place.replaceChildren(picture);
    this.text.textContent = path.length
      ? "Filled: the way of the selected output's data. Dashed: nodes whose jobs went first. Outlined: the rest of the chain."
      : "Outlined: the selected chain or task.";
  }

  private words(run: Run, path: number[], behind: Set<number>, selected: Set<number>): string {
    const names = (nodes: Iterable<number>): string =>
      [...new Set(nodes)].map((n) => run.graph?.nodes[n]?.name ?? "").join(", ");
    if (!path.length) return `Graph; selected: ${names(selected)}`;
    return `Graph; way of the data: ${names(path)}; went first: ${names(behind) || "none"}`;
  }
}
