// One websocket to the server: JSON text both ways, and binary messages with images behind a JSON head.

const PING_EVERY = 500; // ms
const RETRY_AFTER = 1000; // ms

export class Link {
  constructor(url, { onMessage, onState }) {
    this.url = url;
    this.onMessage = onMessage;
    this.onState = onState;
    this.roundTrips = []; // ms, the last 40
    this.open();
    setInterval(() => this.send({ type: "ping", sent: performance.now() }), PING_EVERY);
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.onState(true);
    this.socket.onclose = (event) => {
      this.onState(false, event.code);
      setTimeout(() => this.open(), RETRY_AFTER);
    };
    this.socket.onmessage = (event) => {
      const message = typeof event.data === "string" ? JSON.parse(event.data) : decode(event.data);
      if (message.type === "pong") this.measured(performance.now() - message.sent);
      else this.onMessage(message);
    };
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  measured(ms) {
    this.roundTrips.push(ms);
    if (this.roundTrips.length > 40) this.roundTrips.shift();
  }
}

function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let offset = 4 + length;
  for (const heat of message.heats) {
    const [count, rows, columns] = heat.shape;
    heat.pixels = new Uint8Array(buffer, offset, count * rows * columns);
    offset += count * rows * columns;
  }
  return message;
}
