import { defineConfig } from "vitest/config";

// `npm run dev` serves the page itself and takes everything else from a running `cathxr run`.
const LIVE = "http://127.0.0.1:8765";

export default defineConfig({
  base: "./",
  build: {
    outDir: "../src/cathxr/web_client",
    emptyOutDir: true,
    rolldownOptions: { input: ["index.html", "calibrate.html", "heart.html", "diag.html", "setup.html"] },
    target: "es2022",
    assetsInlineLimit: 0, // the server's content policy lets nothing in but files of its own
    chunkSizeWarningLimit: 900,
    reportCompressedSize: true,
  },
  server: {
    proxy: {
      "/ws": { target: LIVE, ws: true, changeOrigin: true },
      "/scene": { target: LIVE, changeOrigin: true },
      "/cameras": { target: LIVE, changeOrigin: true },
      "/qr.svg": { target: LIVE, changeOrigin: true },
      "/api": { target: LIVE, changeOrigin: true },
      "/calibration/": { target: LIVE, changeOrigin: true },
      "/heart/": { target: LIVE, changeOrigin: true },
    },
  },
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});
