// SPDX-License-Identifier: MIT
//
// Lines, points and pictures of cameras: as they are, into the colours and the identities of the
// walked picture, or over the canvas.

precision highp float;
precision highp int;

uniform sampler2D pictures;
uniform bool hasPicture;
flat in uint vertexId;
in vec4 vertexColor;
in vec3 fromEye;
in vec2 place;
layout(location = 0) out vec4 colorOut;
layout(location = 1) out uvec4 dataOut;

void main() {
  float away = length(fromEye);
  gl_FragDepth = away / (1.0 + away);
  colorOut = hasPicture && place.x >= 0.0 ? texture(pictures, place) : vertexColor;
  dataOut = uvec4(vertexId, floatBitsToUint(away), 0u, packUnorm2x16(vec2(1.0)));
}
