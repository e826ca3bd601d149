"""The link to clients: messages, the hub that hands out the newest Track, and the HTTP and WebSocket server."""
