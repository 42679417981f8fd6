// Endless motion from the service: WS /v1/stream.

const LATE = 4000; // [ms] without a frame until something is said

/**
 * Poses as they come, from a model.
 *
 * `settings`: what the service is asked for; `pose`: called with each Float32Array (25); `trouble`: called with words.
 */
export class Stream {
  constructor(settings, { pose, trouble }) {
    this.told = { ...settings };
    this.trouble = trouble;
    const address = new URL("/v1/stream", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.socket.send(JSON.stringify(this.told));
    this.socket.onmessage = ({ data }) => {
      this.heard();
      if (typeof data === "string") this.answered(JSON.parse(data));
      else pose(new Float32Array(data));
    };
    this.socket.onclose = () => this.failed("The motion has ended: the service closed it. Choose the model again.");
    this.heard();
  }

  /** Change settings while it runs. */
  change(settings) {
    Object.assign(this.told, settings);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(settings));
    this.heard();
  }

  close() {
    this.trouble = () => {};
    clearTimeout(this.timer);
    this.socket.close();
  }

  answered(message) {
    if (message.type === "problem") this.failed(message.errors[0]?.problem ?? message.detail);
  }

  heard() {
    clearTimeout(this.timer);
    if (this.told.paused) return;
    this.timer = setTimeout(() => this.failed("No motion has come for some seconds: the service may be busy."), LATE);
  }

  failed(words) {
    clearTimeout(this.timer);
    this.trouble(words);
  }
}
