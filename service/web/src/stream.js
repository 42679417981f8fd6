// Endless motion from the service: WS /v1/stream.

const LATE = 4000; // [ms] without a frame until something is said

/**
 * Poses as they come, from a model.
 *
 * `settings`: what the service is asked for; `pose`: called with each Float32Array (25); `say`: called with
 * words when something is wrong, and with none when it is right again.
 */
export class Stream {
  constructor(settings, { pose, say }) {
    this.told = { ...settings };
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
      this.tell(`The motion has ended. Choose the model again. ${reason}`);
    };
    this.heard();
  }

  /** Change settings while it runs. */
  change(settings) {
    Object.assign(this.told, settings);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(settings));
    this.heard();
  }

  close() {
    this.say = () => {};
    clearTimeout(this.timer);
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
