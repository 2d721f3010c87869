// SPDX-License-Identifier: MIT
//
// Walks one ray from cell to cell and composites what it sees. In cell i, with n = p_j - p_i and
// r = o - p_i, the ray o + t d leaves through the neighbour j with n.d > 0 and the smallest
// t = (|n|^2 / 2 - r.n) / (n.d). FoamRenderer puts SH_COEFFICIENTS, RECORD_TEXELS, HAS_GRADIENT and
// HAS_IDENTITY before this text.

precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;

uniform usampler2D sites;       // position bits, and where the list of neighbours begins
uniform usampler2D neighbours;  // for each cell: how many, then which
uniform usampler2D records;     // RECORD_TEXELS for each site (foam_data.ts)
uniform usampler2D identities;  // 16 int8 for each site
uniform sampler2D classifier;   // for each class: 4 texels of weights, 1 with the bias
// For each class, and for cells without: shares of the density shown (of objects, of other cells),
// and the class that it is shown as, low byte first.
uniform usampler2D states;
uniform int widthBits;          // log2 of the textures' width
uniform uint numSites;
uniform int numClasses;
uniform int maxSteps;
uniform uint startCell;
uniform uint noNeighbour;
uniform vec3 origin;
uniform mat3 worldFromCam;
uniform vec2 focal;   // pixels of the target
uniform vec2 center;  // the principal point, from the target's lower left corner
uniform vec3 background;
uniform float cutoffTau;
uniform float negligibleWeight;
uniform bool exactLabels;  // class of the composited identity; else that of the cell at the depth
uniform vec4 keep;         // shows x where keep.xyz . x >= keep.w
uniform bool isLayer;      // leaves out pixels that stay transparent, for drawing over others

layout(location = 0) out vec4 colorOut;
// Class + 1 (0: none), bits of the distance at transmittance 1/2 (0: none), cell there + 1,
// opacity and confidence as 16 bits each.
layout(location = 1) out uvec4 dataOut;

const float INFINITE = 3.0e38;
const float LN2 = 0.69314718;
const uint NO_CLASS = 0x7fffu;

ivec2 at(uint index) {
  return ivec2(int(index) & ((1 << widthBits) - 1), int(index >> uint(widthBits)));
}

float signedByte(uvec4 texel, int b) {
  return float(int(texel[b >> 2] << (24 - 8 * (b & 3))) >> 24);
}

// 1 / x - 1 / (e^x - 1): where the centroid of the weight lies within a segment.
float centroidShare(float x) {
  if (x < 0.05) return 0.5 - x / 12.0;
  return 1.0 / x - exp(-x) / (1.0 - exp(-x));
}

void shBasis(vec3 d, out float basis[16]) {
  basis[0] = 0.28209479177387814;
#if SH_COEFFICIENTS > 1
  basis[1] = -0.4886025119029199 * d.y;
  basis[2] = 0.4886025119029199 * d.z;
  basis[3] = -0.4886025119029199 * d.x;
#endif
#if SH_COEFFICIENTS > 4
  float xx = d.x * d.x, yy = d.y * d.y, zz = d.z * d.z;
  basis[4] = 1.0925484305920792 * d.x * d.y;
  basis[5] = -1.0925484305920792 * d.y * d.z;
  basis[6] = 0.31539156525252005 * (2.0 * zz - xx - yy);
  basis[7] = -1.0925484305920792 * d.x * d.z;
  basis[8] = 0.5462742152960396 * (xx - yy);
#endif
#if SH_COEFFICIENTS > 9
  basis[9] = -0.5900435899266435 * d.y * (3.0 * xx - yy);
  basis[10] = 2.890611442640554 * d.x * d.y * d.z;
  basis[11] = -0.4570457994644658 * d.y * (4.0 * zz - xx - yy);
  basis[12] = 0.3731763325901154 * d.z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
  basis[13] = -0.4570457994644658 * d.x * (4.0 * zz - xx - yy);
  basis[14] = 1.445305721320277 * d.z * (xx - yy);
  basis[15] = -0.5900435899266435 * d.x * (xx - 3.0 * yy);
#endif
}

// The colour of a site along the ray, at `offset` from it.
vec3 cellColor(uvec4 head, uint cell, float basis[16], vec3 offset, bool whole) {
  vec2 a = unpackHalf2x16(head.x), b = unpackHalf2x16(head.y);
  vec3 color = 0.5 + basis[0] * vec3(a.y, b.x, b.y);
  if (whole) {
    uvec4 texels[RECORD_TEXELS];
    texels[0] = head;
    for (int k = 1; k < RECORD_TEXELS; ++k) {
      texels[k] = texelFetch(records, at(cell * uint(RECORD_TEXELS) + uint(k)), 0);
    }
#if SH_COEFFICIENTS > 1
    vec3 sh = vec3(0);
    for (int k = 1; k < SH_COEFFICIENTS; ++k) {
      int begin = 22 + 3 * (k - 1);
      sh += basis[k] * vec3(signedByte(texels[begin >> 4], begin & 15),
                            signedByte(texels[(begin + 1) >> 4], (begin + 1) & 15),
                            signedByte(texels[(begin + 2) >> 4], (begin + 2) & 15));
    }
    color += sh * exp2(signedByte(head, 11));
#endif
#if HAS_GRADIENT
    vec3 slope = vec3(0);
    for (int axis = 0; axis < 3; ++axis) {
      int begin = 13 + 3 * axis;
      slope += offset[axis] * vec3(signedByte(texels[begin >> 4], begin & 15),
                                   signedByte(texels[(begin + 1) >> 4], (begin + 1) & 15),
                                   signedByte(texels[(begin + 2) >> 4], (begin + 2) & 15));
    }
    color += slope * exp2(signedByte(head, 10));
#endif
  }
  return max(color, 0.0);
}

// Class + 1 and the confidence of an identity, among the classes of which something is shown.
uint classOf(vec4 identity[4], out float confidence) {
  float largest = -INFINITE, sum = 0.0;
  uint best = 0u;
  for (int k = 0; k < numClasses; ++k) {
    uvec4 shown = texelFetch(states, at(uint(k)), 0);
    if (shown.x == 0u && shown.y == 0u) continue;
    float logit = texelFetch(classifier, at(uint(5 * k + 4)), 0).x;
    for (int c = 0; c < 4; ++c) {
      logit += dot(texelFetch(classifier, at(uint(5 * k + c)), 0), identity[c]);
    }
    if (logit > largest) {
      sum = sum * exp(largest - logit) + 1.0;
      largest = logit;
      best = uint(k) + 1u;
    } else {
      sum += exp(logit - largest);
    }
  }
  confidence = sum > 0.0 ? 1.0 / sum : 0.0;
  return best;
}

void main() {
  vec2 pixel = (gl_FragCoord.xy - center) / focal;
  vec3 direction = normalize(worldFromCam * vec3(pixel.x, -pixel.y, 1.0));
  float basis[16];
  shBasis(direction, basis);

  // Where the ray is in the half space to show.
  float along = dot(keep.xyz, direction), height = dot(keep.xyz, origin) - keep.w;
  float firstShown = 0.0, lastShown = INFINITE;
  if (along > 0.0) firstShown = max(0.0, -height / along);
  else if (along < 0.0) lastShown = height < 0.0 ? -1.0 : -height / along;
  else if (height < 0.0) lastShown = -1.0;

  uint cell = startCell;
  float tau = 0.0, t = 0.0, distanceAtHalf = 0.0;
  uint cellAtHalf = 0u, classAtHalf = 0u;
  vec3 color = vec3(0);
  vec4 identity[4] = vec4[4](vec4(0), vec4(0), vec4(0), vec4(0));
  for (int step = 0; step < maxSteps; ++step) {
    uvec4 site = texelFetch(sites, at(cell), 0);
    vec3 p = uintBitsToFloat(site.xyz), r = origin - p;
    uint count = texelFetch(neighbours, at(site.w), 0).x;
    float exit = INFINITE;
    uint next = noNeighbour;
    for (uint k = 1u; k <= count; ++k) {
      uint j = texelFetch(neighbours, at(site.w + k), 0).x;
      vec3 n = uintBitsToFloat(texelFetch(sites, at(j), 0).xyz) - p;
      float nd = dot(n, direction), nn = dot(n, n);
      // Below, the sign of n.d is uncertain; going backwards could be repeated for ever.
      if (nd <= 0.0 || nd * nd < 1.0e-12 * nn) continue;
      float crossing = (0.5 * nn - dot(r, n)) / nd;
      if (crossing < exit) {
        exit = crossing;
        next = j;
      }
    }
    if (next == noNeighbour) break;
    float tOut = max(t, exit);
    float from = max(t, firstShown), to = min(tOut, lastShown);
    if (cell < numSites && to > from) {
      uvec4 head = texelFetch(records, at(cell * uint(RECORD_TEXELS)), 0);
      uint flags = head.z & 0xffffu, own = flags & 0x7fffu;
      int state = own == NO_CLASS ? numClasses : int(own);
      uvec4 shown = texelFetch(states, at(uint(state)), 0);
      float share = float((flags & 0x8000u) != 0u ? shown.y : shown.x) / 255.0;
      float sigma = unpackHalf2x16(head.x).x * share;
      if (sigma > 1.0e-6) {
        float x = sigma * (to - from);
        float weight = exp(-tau) * (x < 1.0e-3 ? x - 0.5 * x * x : 1.0 - exp(-x));
        bool counts = weight > negligibleWeight;
        vec3 offset = r + direction * (from + (to - from) * centroidShare(x));
        color += weight * cellColor(head, cell, basis, offset, counts);
#if HAS_IDENTITY
        if (exactLabels && counts) {
          uvec4 bytes = texelFetch(identities, at(cell), 0);
          float scale = weight * exp2(signedByte(head, 12));
          for (int c = 0; c < 4; ++c) {
            identity[c] += scale * vec4(signedByte(bytes, 4 * c),
                                        signedByte(bytes, 4 * c + 1),
                                        signedByte(bytes, 4 * c + 2),
                                        signedByte(bytes, 4 * c + 3));
          }
        }
#endif
        if (tau < LN2 && tau + x >= LN2) {
          distanceAtHalf = min(to, from + (LN2 - tau) / sigma);
          cellAtHalf = cell + 1u;
          classAtHalf = own == NO_CLASS ? 0u : own + 1u;
        }
        tau += x;
        if (tau >= cutoffTau) break;
      }
    }
    if (tOut >= lastShown) break;
    t = tOut;
    cell = next;
  }
  float transmittance = exp(-tau), confidence = 0.0;
  if (isLayer && transmittance > 0.5) discard;
  gl_FragDepth = distanceAtHalf > 0.0 ? distanceAtHalf / (1.0 + distanceAtHalf) : 1.0;
  uint label = classAtHalf;
#if HAS_IDENTITY
  if (exactLabels) label = transmittance <= 0.5 ? classOf(identity, confidence) : 0u;
#endif
  if (label > 0u) {
    // Of a label that was merged into another: that.
    uvec4 merged = texelFetch(states, at(label - 1u), 0);
    label = 1u + merged.z + (merged.w << 8u);
  }
  colorOut = vec4(color + transmittance * background, 1.0);
  dataOut = uvec4(label, floatBitsToUint(distanceAtHalf), cellAtHalf,
                  packUnorm2x16(vec2(1.0 - transmittance, confidence)));
}
