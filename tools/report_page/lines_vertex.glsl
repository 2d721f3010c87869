// SPDX-License-Identifier: MIT
//
// The corners of lines, drawn as two triangles each (instances), `lineWidth` pixels wide.

precision highp float;

uniform vec3 origin;
uniform mat3 worldFromCam;
uniform vec2 focal;
uniform vec2 center;
uniform vec2 sizeInPixels;
uniform float lineWidth;
uniform uint firstId;
in vec3 begin;
in vec3 end;
in vec4 color;
in float id;  // of cameras, from 1 on; 0: none
flat out uint vertexId;
out vec4 vertexColor;
out vec3 fromEye;
out vec2 place;

void main() {
  const float near = 0.002;
  vec3 world[2] = vec3[2](begin - origin, end - origin);
  vec3 cam[2] = vec3[2](transpose(worldFromCam) * world[0], transpose(worldFromCam) * world[1]);
  // Ends behind the eye move onto the near plane.
  for (int k = 0; k < 2; ++k) {
    vec3 other = cam[1 - k];
    if (cam[k].z < near && other.z > near) {
      float share = (near - cam[k].z) / (other.z - cam[k].z);
      world[k] = mix(world[k], world[1 - k], share);
      cam[k] = mix(cam[k], other, share);
    }
  }
  vec2 pixel[2];
  for (int k = 0; k < 2; ++k) {
    pixel[k] = vec2(focal.x * cam[k].x, -focal.y * cam[k].y) / max(cam[k].z, near) + center;
  }
  int which = gl_VertexID == 1 || gl_VertexID == 2 || gl_VertexID == 4 ? 1 : 0;
  float side = gl_VertexID == 2 || gl_VertexID == 4 || gl_VertexID == 5 ? 1.0 : -1.0;
  vec2 along = pixel[1] - pixel[0];
  along = length(along) > 1e-6 ? normalize(along) : vec2(1, 0);
  vec2 at = pixel[which] + side * 0.5 * lineWidth * vec2(-along.y, along.x);
  float z = cam[which].z;
  gl_Position = vec4((2.0 * at / sizeInPixels - 1.0) * z, 0.0, z);
  fromEye = world[which];
  vertexColor = color;
  vertexId = id > 0.5 ? firstId + uint(id) - 1u : 0u;
  place = vec2(-1);
}
