// The WebSocket to the server. It reconnects by itself.

export class Connection {
  /** @param on  functions: text(object), binary(buffer), state(name) */
  constructor(on) {
    this.on = on;
    this.bytes = 0;
    this.open();
  }

  open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    this.socket = new WebSocket(`${scheme}://${location.host}/${location.search}`, 'tfdude.v1');
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.on.state('open');
    this.socket.onclose = () => {
      this.on.state('closed');
      setTimeout(() => this.open(), 1000);
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data === 'string') {
        this.bytes += data.length;
        this.on.text(JSON.parse(data));
      } else {
        this.bytes += data.byteLength;
        this.on.binary(data);
      }
    };
  }

  send(request) { this.sendRaw(JSON.stringify(request)); }

  sendRaw(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(message);
  }
}
