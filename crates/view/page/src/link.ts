/** The connection: one that comes back by itself, with questions that are answered or refused. */

import { decode, type CoarseFrame, type Plane, type Scan, type TileFrame, type Told } from "./protocol.ts";

export interface Listener {
  told(message: Told): void;
  frame(frame: CoarseFrame | TileFrame): void;
  /** How the connection is; `dead` means that the secret is wrong or the server has gone for long. */
  connection(how: "open" | "lost" | "dead"): void;
}

interface Waiting {
  answer(value: unknown): void;
  refuse(why: Error): void;
}

const TEXT = new TextEncoder();

export class Link {
  private socket: WebSocket | null = null;
  private next = 1;
  private readonly waiting = new Map<number, Waiting>();
  private tries = 0;
  private opened = false;
  private timer = 0;

  constructor(
    private readonly token: string,
    private readonly listener: Listener,
  ) {
    this.connect();
    // A laptop that wakes up shall not wait for its timer.
    addEventListener("online", () => this.hurry());
    document.addEventListener("visibilitychange", () => this.hurry());
  }

  private hurry(): void {
    if (document.visibilityState === "visible" && (!this.socket || this.socket.readyState > 1)) {
      clearTimeout(this.timer);
      this.connect();
    }
  }

  private connect(): void {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/ws?token=${encodeURIComponent(this.token)}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    let worked = false;
    socket.onopen = () => {
      worked = true;
      this.opened = true;
      this.tries = 0;
      this.listener.connection("open");
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(event.data);
    socket.onclose = () => {
      if (this.socket !== socket) return;
      for (const one of this.waiting.values()) one.refuse(new Error("the connection was lost"));
      this.waiting.clear();
      this.tries += 1;
      this.listener.connection(!worked && (!this.opened || this.tries > 40) ? "dead" : "lost");
      this.timer = window.setTimeout(() => this.connect(), Math.min(4000, 150 * 1.5 ** this.tries));
    };
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data === "string") {
      const message = JSON.parse(data) as Told;
      if (message.type === "answer") this.settle(message.id, (w) => w.answer(message.value));
      else if (message.type === "refusal" && message.id !== null) {
        this.settle(message.id, (w) => w.refuse(new Error(message.why)));
      } else this.listener.told(message);
      return;
    }
    const frame = decode(data);
    if (!frame) return;
    if (frame.kind === "plane" || frame.kind === "scan") this.settle(frame.id, (w) => w.answer(frame));
    else this.listener.frame(frame);
  }

  private settle(id: number, how: (waiting: Waiting) => void): void {
    const waiting = this.waiting.get(id);
    this.waiting.delete(id);
    if (waiting) how(waiting);
  }

  get open(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Drops the connection, as a network does; it comes back by itself. */
  drop(): void {
    this.socket?.close();
  }

  say(message: object): boolean {
    if (!this.open) return false;
    this.socket?.send(JSON.stringify(message));
    return true;
  }

  /** Asks, and waits for the answer. */
  ask<T>(message: { type: string; [key: string]: unknown }): Promise<T> {
    const id = this.next++;
    return new Promise<T>((answer, refuse) => {
      this.waiting.set(id, { answer: answer as (value: unknown) => void, refuse });
      if (!this.say({ ...message, id })) {
        this.waiting.delete(id);
        refuse(new Error("there is no connection"));
      }
    });
  }

  plane(message: { type: string; [key: string]: unknown }): Promise<Plane> {
    return this.ask<Plane>(message);
  }

  scan(pane: number): Promise<Scan> {
    return this.ask<Scan>({ type: "scan", pane });
  }

  /** Sends a file. */
  file(name: string, bytes: ArrayBuffer): Promise<void> {
    const id = this.next++;
    const label = TEXT.encode(name);
    const message = new Uint8Array(12 + label.length + bytes.byteLength);
    const view = new DataView(message.buffer);
    [16, id, label.length].forEach((word, i) => view.setUint32(4 * i, word, true));
    message.set(label, 12);
    message.set(new Uint8Array(bytes), 12 + label.length);
    return new Promise((answer, refuse) => {
      if (!this.open) return refuse(new Error("there is no connection"));
      this.waiting.set(id, { answer: () => answer(), refuse });
      this.socket?.send(message);
    });
  }
}
