// SPDX-License-Identifier: MIT
//
// Surfaces, lines and points: positions are boxOrigin + boxStep * position, moved by `offset`.

precision highp float;

uniform vec3 origin;
uniform mat3 worldFromCam;
uniform vec2 focal;
uniform vec2 center;
uniform vec2 sizeInPixels;
uniform vec3 boxOrigin;
uniform vec3 boxStep;
uniform vec3 offset;
uniform float pointSize;
uniform uint firstId;   // of the first vertex
uniform bool sharesId;  // one id for every six vertices, else for each
in vec3 position;
in vec4 color;
in vec2 uv;
flat out uint vertexId;
out vec2 place;
out vec4 vertexColor;
out vec3 ownPlace;
out vec3 fromEye;

void main() {
  ownPlace = boxOrigin + boxStep * position;
  fromEye = ownPlace + offset - origin;
  vec3 inCamera = transpose(worldFromCam) * fromEye;
  vec2 pixel = vec2(focal.x * inCamera.x, -focal.y * inCamera.y) + center * inCamera.z;
  const float near = 0.002, far = 200.0;
  float depth = ((far + near) * inCamera.z - 2.0 * far * near) / (far - near);
  gl_Position = vec4(2.0 * pixel / sizeInPixels - inCamera.z, depth, inCamera.z);
  gl_PointSize = pointSize;
  vertexColor = color;
  vertexId = firstId + uint(sharesId ? gl_VertexID / 6 : gl_VertexID);
  place = uv;
}
