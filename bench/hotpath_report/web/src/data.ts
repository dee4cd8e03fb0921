// SPDX-License-Identifier: Apache-2.0
// The data of the page: a JSON document, deflated and in base64. hotpath computed every number in it.

/** How a curve looks: colour and dash tell it apart. */
export interface Look {
  label: string; colour: string; dash: number[];
}

/** One of the page's curves: an executor of a run. */
export interface Series extends Look {
  run: number; executor: string;
}

/** A curve over a quantity, with a value and its interval at each x. */
export interface Line extends Look {
  x: number[]; value: number[]; low: (number | null)[]; high: (number | null)[];
}

export interface Plot {
  title: string; x: string; log: boolean; lines: Line[];
  figure: string; // id of the figure that it replaces
}

/** A distribution at the probabilities `q`, in ms; the last point is the largest sample. */
export interface Curve {
  series: number; n: number; repetitions: number; q: number[]; value: number[]; low: (number | null)[];
  high: (number | null)[];
}

/** A line in a distribution: a bound, a deadline, or the computation on a path. */
export interface Mark {
  label: string; ms: number;
  series: number | null; // null: of all
}

export interface Target {
  kind: "chain" | "task"; name: string; title: string; measure: string;
  figure: string; // id of its violins
  curves: Curve[]; marks: Mark[];
}

export interface Task {
  name: string; kind: string; period_ns: number;
}

export interface Graph {
  nodes: { name: string; type: string; column: number; row: number }[];
  edges: [number, number, string][];
  chains: { name: string; tasks: number[] }[];
  node_of_task: number[];
}

type Columns = Record<string, number[]>;

export interface StoredRepetition {
  executor: string; repetition: number; length_ns: number; kept_ns: [number, number][];
  jobs: Columns;
}

export interface StoredOutputs {
  chain?: string; task?: number; executor: string; outputs: number; missing: number; repetition: number[]; sequence: number[];
  end_ns: number[]; latency_ns: number[]; complete: number[]; causes_ns: number[][]; parts: number[];
  part: Columns; steps: number[]; step: Columns;
}

export interface Run {
  name: string; source: string; executors: string[]; tasks: Task[]; graph?: Graph;
  repetitions?: StoredRepetition[]; outputs?: StoredOutputs[]; responses?: StoredOutputs[]; warm_up_ns: number;
  jobs?: { started: number; kept: number };
  notes: string[];
}

export interface Cause {
  name: string; phrase: string; colour: string;
}

export interface Document {
  causes: Cause[]; rules: string[]; series: Series[]; targets: Target[]; runs: Run[]; plots?: Plot[];
  shown?: number; // curves that are switched on at first
}

interface ByteStream {
  readable: ReadableStream<Uint8Array>; writable: WritableStream<Uint8Array>;
}
declare const DecompressionStream: new (format: string) => ByteStream; // not yet in TypeScript 4.8

export async function readDocument(base64: string): Promise<Document> {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i); // ten times as fast as from()
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return (await new Response(stream).json()) as Document;
}

function sums(differences: number[]): Float64Array {
  let sum = 0;
  return Float64Array.from(differences, (d) => (sum += d));
}

/** The jobs of one repetition in order of start, as typed arrays; instants in ns since its epoch. */
export class Jobs {
  readonly task: Int32Array;
  readonly sequence: Float64Array;
  readonly start: Float64Array;
  readonly end: Float64Array; // of the repetition, for a job that did not finish
  readonly timestamp: Float64Array;
  readonly release: Float64Array;
  readonly worker: Int32Array;
  readonly parent: Int32Array; // task; -1: none
  readonly parentSequence: Float64Array;
  private index: Map<number, number> | undefined;

  constructor(readonly of: StoredRepetition, private readonly tasks: number) {
    const c = of.jobs;
    this.task = Int32Array.from(c.task);
    this.worker = Int32Array.from(c.worker);
    this.parent = Int32Array.from(c.parent);
    this.start = sums(c.start);
    this.end = Float64Array.from(c.length, (length, i) => (length < 0 ? of.length_ns : this.start[i] + length));
    this.timestamp = Float64Array.from(c.before_timestamp, (d, i) => this.start[i] - d);
    this.release = Float64Array.from(c.before_release, (d, i) => this.start[i] - d);
    const last = new Float64Array(tasks);
    this.sequence = Float64Array.from(c.sequence, (d, i) => (last[this.task[i]] += d));
    this.parentSequence = Float64Array.from(c.parent_sequence, (d, i) => this.sequence[i] - d);
  }

  get size(): number {
    return this.task.length;
  }

  /** Position of a job; -1: the page does not have it. */
  find(task: number, sequence: number): number {
    if (!this.index) {
      this.index = new Map();
      for (let i = 0; i < this.size; ++i) this.index.set(this.sequence[i] * this.tasks + this.task[i], i);
    }
    return this.index.get(sequence * this.tasks + task) ?? -1;
  }

  kept(from: number, to: number): boolean {
    return this.of.kept_ns.some(([a, b]) => a <= Math.max(0, from) && to <= b);
  }
}

/** A part of a latency with one cause. */
export interface Part {
  cause: number; rule: number; step: number;
  behind: number; // task; -1: none
  behindSequence: number; ns: number;
}

/** An output of a chain, or a job of a task. */
export interface Output {
  series: number; repetition: number; sequence: number; end: number; latency: number;
  causes: number[] | null; // ns, by cause
  parts: Part[];
  path: { task: number; sequence: number }[];
}

function offsets(counts: number[]): number[] {
  let sum = 0;
  return counts.map((n) => (sum += n) - n);
}

/** Gives typed views of the document, made when first needed. */
export class Store {
  private readonly jobs = new Map<StoredRepetition, Jobs>();
  private readonly lists = new Map<string, Output[]>();

  constructor(readonly document: Document) {}

  run(series: number): Run {
    return this.document.runs[this.document.series[series].run];
  }

  repetitions(series: number): StoredRepetition[] {
    const executor = this.document.series[series].executor;
    return (this.run(series).repetitions ?? []).filter((r) => r.executor === executor);
  }

  jobsOf(series: number, repetition: number): Jobs | undefined {
    const of = this.repetitions(series).find((r) => r.repetition === repetition);
    if (!of) return undefined;
    let jobs = this.jobs.get(of);
    if (!jobs) this.jobs.set(of, (jobs = new Jobs(of, this.run(series).tasks.length)));
    return jobs;
  }

  /** The number of outputs, of which `outputs()` lists all or some. */
  total(target: Target, series: number): number {
    return target.curves.find((c) => c.series === series)?.n ?? 0;
  }

  outputs(target: Target, series: number): Output[] {
    const key = `${target.kind} ${target.name} ${series}`;
    let list = this.lists.get(key);
    if (!list) {
      list = target.kind === "chain" ? this.ofChain(target.name, series) : this.ofTask(target.name, series);
      this.lists.set(key, list);
    }
    return list;
  }

  private ofChain(chain: string, series: number): Output[] {
    const executor = this.document.series[series].executor;
    return this.explained(series, (this.run(series).outputs ?? []).find((o) => o.chain === chain && o.executor === executor));
  }

  private explained(series: number, of: StoredOutputs | undefined): Output[] {
    if (!of) return [];
    const firstPart = offsets(of.parts);
    const firstStep = offsets(of.steps);
    return of.latency_ns.map((latency, i) => ({
      series, latency, repetition: of.repetition[i], sequence: of.sequence[i], end: of.end_ns[i],
      causes: of.causes_ns.map((column) => column[i]),
      parts: Array.from({ length: of.parts[i] }, (_, k) => {
        const at = firstPart[i] + k;
        const p = of.part;
        return {
          cause: p.cause[at], rule: p.rule[at], step: p.step[at], ns: p.ns[at],
          behind: p.behind[at], behindSequence: p.behind_sequence[at],
        };
      }),
      path: Array.from({ length: of.steps[i] }, (_, k) => ({
        task: of.step.task[firstStep[i] + k],
        sequence: of.step.sequence[firstStep[i] + k],
      })),
    }));
  }

  private ofTask(name: string, series: number): Output[] {
    const task = this.run(series).tasks.findIndex((t) => t.name === name);
    const { warm_up_ns: warmUp, responses } = this.run(series);
    const list: Output[] = [];
    const { executor } = this.document.series[series];
    const slowest = this.explained(series, responses?.find((r) => r.task === task && r.executor === executor));
    const known = new Map(slowest.map((o) => [`${o.repetition} ${o.sequence}`, o]));
    for (const of of this.repetitions(series)) {
      const jobs = this.jobsOf(series, of.repetition);
      for (let i = 0; jobs && i < jobs.size; ++i) {
        if (jobs.task[i] !== task || of.jobs.length[i] < 0 || jobs.timestamp[i] < warmUp) continue;
        const { repetition } = of;
        const sequence = jobs.sequence[i];
        const end = jobs.end[i];
        const id = `${repetition} ${sequence}`;
        const { causes, parts } = known.get(id) ?? { causes: null, parts: [] };
        known.delete(id);
        const latency = end - jobs.timestamp[i];
        list.push({ series, repetition, sequence, end, latency, causes, parts, path: [{ task, sequence }] });
      }
    }
    return [...list, ...known.values()]; // and those that a thinned page does not keep
  }
}
