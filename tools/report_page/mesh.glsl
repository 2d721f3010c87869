// SPDX-License-Identifier: MIT
//
// Surfaces of objects in the photos' colours, each face lit from the eye, so that their shape shows.

precision highp float;
precision highp int;

uniform uint label;
uniform bool isDim;
uniform vec4 keep;  // shows x where keep.xyz . x >= keep.w
in vec4 vertexColor;
in vec3 ownPlace;
in vec3 fromEye;
layout(location = 0) out vec4 colorOut;
layout(location = 1) out uvec4 dataOut;

void main() {
  if (dot(keep.xyz, ownPlace) < keep.w) discard;
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (isDim && ((pixel.x + pixel.y) & 3) != 0) discard;
  vec3 normal = normalize(cross(dFdx(ownPlace), dFdy(ownPlace)));
  float light = 0.45 + 0.6 * abs(dot(normal, normalize(fromEye)));
  // Slightly nearer, as the foam's matter begins at the same place.
  float away = length(fromEye) * 0.997;
  gl_FragDepth = away / (1.0 + away);
  colorOut = vec4(vertexColor.rgb * light, 1.0);
  dataOut = uvec4(label, floatBitsToUint(length(fromEye)), 0u, packUnorm2x16(vec2(1.0)));
}
