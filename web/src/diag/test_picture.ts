/** A test picture that keeps the graphics busy: how long it takes compares devices with each other. */

const SIZE = 1024;
const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0); }`;
/** About what a pixel of the ultrasound image costs: a march of 48 steps with a little arithmetic. */
const FRAGMENT = `#version 300 es
precision highp float;
uniform float seed;
out vec4 colour;
void main() {
  vec3 at = vec3(gl_FragCoord.xy / ${SIZE}.0, seed);
  float sum = 0.0;
  for (int i = 0; i < 48; i++) {
    at = fract(at * 1.37 + at.yzx * 0.61 + 0.17);
    sum += sqrt(dot(at, at)) * exp(-sum);
  }
  colour = vec4(fract(sum), at);
}`;

export class TestPicture {
  private readonly program: WebGLProgram;
  private readonly pixel = new Uint8Array(4);
  private count = 0;

  /** Throws Error when the graphics do not take the shader. */
  constructor(private readonly gl: WebGL2RenderingContext) {
    gl.canvas.width = gl.canvas.height = SIZE;
    this.program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]] as const) {
      const shader = gl.createShader(kind);
      if (shader === null) throw new Error("The graphics take no shader.");
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(this.program) ?? "The graphics do not take the test picture's shader.");
    }
  }

  /** Draws it and returns the milliseconds until it is there. */
  draw(): number {
    const { gl } = this;
    gl.viewport(0, 0, SIZE, SIZE);
    gl.useProgram(this.program);
    gl.uniform1f(gl.getUniformLocation(this.program, "seed"), 0.37 + 0.01 * (this.count++ % 7)); // never quite the same
    const begun = performance.now();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readPixels(SIZE >> 1, SIZE >> 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.pixel); // waits for it
    return performance.now() - begun;
  }
}
