// Endless motion from the service: WS /v1/stream.

const LATE = 4000; // [ms] without a frame until something is said
const PATIENT = 100; // [ms] in which changes are gathered

/**
 * Poses as they come, from a model.
 *
 * `settings`: what the service is asked for; `pose`: called with each Float32Array (25); `say`: called with
 * words when something is wrong, and with none when it is right again.
 */
export class Stream {
  constructor(settings, { pose, say }) {
    this.told = { paused: false, ...settings };
    this.untold = {};
    this.say = say;
    this.words = "";
    const address = new URL("/v1/stream", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.socket.send(JSON.stringify(this.told));
    this.socket.onmessage = ({ data }) => {
      this.heard();
      if (typeof data === "string") {
        this.answered(JSON.parse(data));
        return;
      }
      this.tell("");
      pose(new Float32Array(data));
    };
    this.socket.onclose = ({ reason }) => {
      clearTimeout(this.timer);
      this.tell(`The motion has ended: the service is gone, or busy. “Another motion” begins a new one. ${reason}`);
    };
    this.heard();
  }

  /** Change settings while it runs: those that differ, some times a second at most. */
  change(settings) {
    const fresh = Object.entries(settings).filter(([name, value]) => this.told[name] !== value);
    if (!fresh.length) return;
    Object.assign(this.told, Object.fromEntries(fresh));
    this.untold = { ...this.untold, ...Object.fromEntries(fresh) };
    this.sending ??= setTimeout(() => this.send(), PATIENT);
    this.heard();
  }

  send() {
    this.sending = null;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(this.untold));
    this.untold = {};
  }

  /** Wait, or go on. */
  hold(paused) {
    this.change({ paused });
  }

  close() {
    this.say = () => {};
    clearTimeout(this.timer);
    clearTimeout(this.sending);
    this.socket.close();
  }

  answered(message) {
    if (message.type === "problem") this.tell(message.errors[0]?.problem ?? message.detail);
  }

  heard() {
    clearTimeout(this.timer);
    if (this.told.paused) return;
    this.timer = setTimeout(() => this.tell("Waiting for motion: the service is busy, or has just begun …"), LATE);
  }

  tell(words) {
    if (words !== this.words) this.say(words);
    this.words = words;
  }
}
