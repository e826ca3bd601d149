import { defineConfig } from "vite";

// `npx vite build tests/harness --outDir …`: pages that only the tests use.
export default defineConfig({
  base: "./",
  publicDir: false,
  build: { rolldownOptions: { input: ["ice.html"] }, target: "es2022", emptyOutDir: true, chunkSizeWarningLimit: 900 },
});
