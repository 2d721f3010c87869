// SPDX-License-Identifier: MIT
//
// Shows a walked picture: averages the rays of a pixel, or enlarges a coarse picture, and colours
// it by the mode.

precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;

uniform sampler2D walkedColor;
uniform usampler2D walkedData;
uniform usampler2D labelColors;  // for each class
uniform int mode;                // 0 colour, 1 labels, 2 confidence, 3 depth, 4 cells
uniform ivec2 size;              // of what is shown, pixels
uniform ivec2 walkedSize;
uniform vec2 depthRange;
uniform int marked;  // class to outline; -1: none
out vec4 shown;

// Dark blue over violet and orange to yellow: lightness grows evenly, for the colour-blind too.
vec3 ramp(float x) {
  x = clamp(x, 0.0, 1.0);
  const vec3 stops[5] = vec3[5](vec3(0.05, 0.03, 0.53), vec3(0.49, 0.01, 0.66),
                                vec3(0.80, 0.28, 0.47), vec3(0.97, 0.58, 0.25),
                                vec3(0.94, 0.98, 0.13));
  float place = x * 4.0;
  int below = min(int(place), 3);
  return mix(stops[below], stops[below + 1], place - float(below));
}

vec3 labelColor(uint label) {
  return vec3(texelFetch(labelColors, ivec2(int(label - 1u), 0), 0).xyz) / 255.0;
}

vec3 sampleAt(ivec2 at, vec3 color) {
  uvec4 data = texelFetch(walkedData, at, 0);
  if (data.x >= 0x10000000u) return color;  // a camera or a point
  vec2 opacity = unpackUnorm2x16(data.w);
  if (mode == 1) {
    if (data.x == 0u) return mix(vec3(1), color, 0.25);
    float light = dot(color, vec3(0.2126, 0.7152, 0.0722));
    return mix(labelColor(data.x), vec3(light), 0.35);
  }
  if (mode == 2) return data.x == 0u ? vec3(1) : ramp(opacity.y);
  if (mode == 3) {
    float far = uintBitsToFloat(data.y);
    if (far == 0.0) return vec3(1);
    return ramp(1.0 - log(far / depthRange.x) / log(depthRange.y / depthRange.x));
  }
  if (mode == 4) {
    ivec2 last = walkedSize - 1;
    uint right = texelFetch(walkedData, min(at + ivec2(1, 0), last), 0).z;
    uint above = texelFetch(walkedData, min(at + ivec2(0, 1), last), 0).z;
    bool edge = right != data.z || above != data.z;
    return edge ? color * 0.35 : mix(color, vec3(1), 0.15);
  }
  return color;
}

uint labelAt(ivec2 at) {
  return texelFetch(walkedData, clamp(at, ivec2(0), walkedSize - 1), 0).x;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 color;
  ivec2 first;
  if (walkedSize.x > size.x) {
    int rays = walkedSize.x / size.x;
    first = pixel * rays;
    color = vec3(0);
    for (int y = 0; y < rays; ++y) {
      for (int x = 0; x < rays; ++x) {
        ivec2 at = first + ivec2(x, y);
        color += sampleAt(at, texelFetch(walkedColor, at, 0).rgb);
      }
    }
    color /= float(rays * rays);
  } else {
    vec2 place = gl_FragCoord.xy / vec2(size);
    first = min(ivec2(place * vec2(walkedSize)), walkedSize - 1);
    color = sampleAt(first, mode == 0 ? texture(walkedColor, place).rgb
                                      : texelFetch(walkedColor, first, 0).rgb);
  }
  if (marked >= 0) {
    uint wanted = uint(marked) + 1u;
    int reach = max(1, 3 * walkedSize.x / (2 * size.x));
    bool inside = labelAt(first) == wanted;
    bool border = labelAt(first + ivec2(reach, 0)) != labelAt(first - ivec2(reach, 0)) ||
                  labelAt(first + ivec2(0, reach)) != labelAt(first - ivec2(0, reach));
    if (border && (inside || labelAt(first + ivec2(reach, 0)) == wanted ||
                   labelAt(first - ivec2(reach, 0)) == wanted ||
                   labelAt(first + ivec2(0, reach)) == wanted ||
                   labelAt(first - ivec2(0, reach)) == wanted)) {
      color = vec3(1.0, 0.62, 0.0);
    }
  }
  shown = vec4(color, 1.0);
}
