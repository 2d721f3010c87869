// SPDX-License-Identifier: MIT
//
// Lines and points in 3D over the walked picture: faint where the foam hides them.

precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D walkedData;
uniform ivec2 size;
uniform ivec2 walkedSize;
in vec4 vertexColor;
in vec3 fromEye;
out vec4 shown;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy / vec2(size) * vec2(walkedSize));
  float far = uintBitsToFloat(texelFetch(walkedData, clamp(at, ivec2(0), walkedSize - 1), 0).y);
  bool hidden = far > 0.0 && length(fromEye) > far * 1.01;
  shown = vec4(vertexColor.rgb, vertexColor.a * (hidden ? 0.12 : 1.0));
}
