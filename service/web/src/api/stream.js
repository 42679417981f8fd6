// Endless motion from the service (WS /v1/stream).

const LATE = 4000; // [ms] without a frame until a message is shown
const DEBOUNCE = 100; // [ms] in which changes are collected

/**
 * A stream of poses from a model.
 *
 * `settings`: of the stream; `pose`: called with each Float32Array (25); `say`: called with a message when something is
 * wrong, and with an empty one when it works again.
 */
export class Stream {
  constructor(settings, { pose, say }) {
    this.settings = { paused: false, ...settings };
    this.pending = {};
    this.say = say;
    this.message = "";
    const address = new URL("/v1/stream", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.socket.send(JSON.stringify(this.settings));
    this.socket.onmessage = ({ data }) => {
      this.restartTimer();
      if (typeof data === "string") {
        this.handle(JSON.parse(data));
        return;
      }
      this.report("");
      pose(new Float32Array(data));
    };
    this.socket.onclose = ({ reason }) => {
      clearTimeout(this.timer);
      this.report(`The stream has ended: the service stopped or is busy. “New motion” starts another one. ${reason}`);
    };
    this.restartTimer();
  }

  /** Change settings while it runs; only changed ones are sent, at most ten times a second. */
  change(settings) {
    const fresh = Object.entries(settings).filter(([name, value]) => this.settings[name] !== value);
    if (!fresh.length) return;
    Object.assign(this.settings, Object.fromEntries(fresh));
    this.pending = { ...this.pending, ...Object.fromEntries(fresh) };
    this.sending ??= setTimeout(() => this.send(), DEBOUNCE);
    this.restartTimer();
  }

  send() {
    this.sending = null;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(this.pending));
    this.pending = {};
  }

  /** Pause or resume. */
  pause(paused) {
    this.change({ paused });
  }

  close() {
    this.say = () => {};
    clearTimeout(this.timer);
    clearTimeout(this.sending);
    // A browser complains of a socket that is closed while it opens.
    if (this.socket.readyState === WebSocket.CONNECTING) this.socket.onopen = () => this.socket.close();
    else this.socket.close();
  }

  handle(message) {
    if (message.type === "problem") this.report(message.errors[0]?.problem ?? message.detail);
  }

  restartTimer() {
    clearTimeout(this.timer);
    if (this.settings.paused) return;
    this.timer = setTimeout(() => this.report("Waiting for motion: the service is busy or starting …"), LATE);
  }

  report(message) {
    if (message !== this.message) this.say(message);
    this.message = message;
  }
}
