// One splat semantics, that of the program itself: see "Contracts" in docs/design.md.
const SPLAT_VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

uniform usampler2D uRows;    // offset, first moment, last moment, bits of the opacity
uniform sampler2D uLives;    // time of full visibility, deviation (0: always), in seconds
uniform sampler2D uPlaces;   // a Gaussian at a moment: mean in metres
uniform sampler2D uTurns;    // its quaternion, wxyz
uniform sampler2D uSizes;    // its logarithmic deviations
uniform sampler2D uColours;  // spherical harmonics, uCoefficients texels a Gaussian
uniform int uCoefficients;
uniform int uMoment;
uniform float uShare, uTime;
uniform mat4 uCameraFromWorld;
uniform vec3 uEye;
uniform vec2 uFocal, uCentre, uSize;

in uint aGaussian;
flat out vec3 vColour;
flat out vec3 vConic;
flat out float vOpacity;
out vec2 vAway;

const float NEAR = 0.2, BLUR = 0.3, LEAST = 1.0 / 255.0;
const vec2 CORNERS[4] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(1, 1));

ivec2 at(int i, ivec2 size) { return ivec2(i % size.x, i / size.x); }
vec3 sh(int k) {
  return texelFetch(uColours, at(int(aGaussian) * uCoefficients + k, textureSize(uColours, 0)), 0).rgb;
}

vec3 colour(vec3 d) {
  float x = d.x, y = d.y, z = d.z;
  vec3 c = 0.28209479177387814 * sh(0);
  if (uCoefficients > 1) c += 0.4886025119029199 * (-y * sh(1) + z * sh(2) - x * sh(3));
  if (uCoefficients > 4)
    c += 1.0925484305920792 * (x * y * sh(4) - y * z * sh(5) - x * z * sh(7))
      + 0.31539156525252005 * (2.0 * z * z - x * x - y * y) * sh(6)
      + 0.5462742152960396 * (x * x - y * y) * sh(8);
  if (uCoefficients > 9)
    c += -0.5900435899266435 * (y * (3.0 * x * x - y * y) * sh(9) + x * (x * x - 3.0 * y * y) * sh(15))
      + 2.890611442640554 * x * y * z * sh(10)
      - 0.4570457994644658 * (4.0 * z * z - x * x - y * y) * (y * sh(11) + x * sh(13))
      + 0.3731763325901154 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y) * sh(12)
      + 1.445305721320277 * z * (x * x - y * y) * sh(14);
  return max(c + 0.5, 0.0);
}

mat3 axes(vec4 q, vec3 s) {
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    s.x * vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
    s.y * vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
    s.z * vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)));
}

void main() {
  gl_Position = vec4(0, 0, 2, 1);  // behind the far plane: nothing is drawn
  uvec4 row = texelFetch(uRows, at(int(aGaussian), textureSize(uRows, 0)), 0);
  int first = int(row.y), last = int(row.z);
  int here = clamp(uMoment, first, last), next = clamp(uMoment + 1, first, last);
  ivec2 size = textureSize(uPlaces, 0);
  ivec2 a = at(int(row.x) + here - first, size), b = at(int(row.x) + next - first, size);
  vec3 mean = mix(texelFetch(uPlaces, a, 0).xyz, texelFetch(uPlaces, b, 0).xyz, uShare);
  vec3 place = (uCameraFromWorld * vec4(mean, 1)).xyz;
  if (place.z < NEAR) return;

  vec2 life = texelFetch(uLives, at(int(aGaussian), textureSize(uLives, 0)), 0).xy;
  float late = life.y > 0.0 ? (uTime - life.x) / life.y : 0.0;
  float opacity = uintBitsToFloat(row.w) * exp(-0.5 * late * late);
  if (opacity < LEAST) return;

  vec4 turn = texelFetch(uTurns, a, 0), other = texelFetch(uTurns, b, 0);
  turn = normalize(mix(turn, dot(turn, other) < 0.0 ? -other : other, uShare));
  vec3 spread = exp(mix(texelFetch(uSizes, a, 0).xyz, texelFetch(uSizes, b, 0).xyz, uShare));
  vec2 low = -(uCentre + 0.15 * uSize) / uFocal, high = (1.15 * uSize - uCentre) / uFocal;
  vec2 slope = clamp(place.xy / place.z, low, high);
  mat3 m = mat3(uCameraFromWorld) * axes(turn, spread);
  vec3 along = (vec3(m[0].x, m[1].x, m[2].x) - slope.x * vec3(m[0].z, m[1].z, m[2].z)) * uFocal.x / place.z;
  vec3 down = (vec3(m[0].y, m[1].y, m[2].y) - slope.y * vec3(m[0].z, m[1].z, m[2].z)) * uFocal.y / place.z;
  float xx = dot(along, along) + BLUR, xy = dot(along, down), yy = dot(down, down) + BLUR;
  float determinant = xx * yy - xy * xy;
  if (!(determinant > 0.0)) return;

  vConic = vec3(yy, -xy, xx) / determinant;
  vOpacity = opacity;
  vColour = colour(normalize(mean - uEye));
  // The ellipse within which alpha is at least 1/255, in a rectangle along its axes.
  float reach = sqrt(2.0 * log(opacity / LEAST));
  float middle = 0.5 * (xx + yy), far = length(vec2(0.5 * (xx - yy), xy));
  vec2 major = abs(xy) > 1e-6 * xx ? normalize(vec2(xy, middle + far - xx)) : (xx >= yy ? vec2(1, 0) : vec2(0, 1));
  vec2 corner = CORNERS[gl_VertexID] * reach;
  vAway = corner.x * sqrt(middle + far) * major
    + corner.y * sqrt(max(middle - far, 0.0)) * vec2(-major.y, major.x);
  vec2 pixel = uFocal * place.xy / place.z + uCentre + vAway;
  gl_Position = vec4(2.0 * pixel / uSize - 1.0, 0, 1);
}`;

const SPLAT_FRAGMENT = `#version 300 es
precision highp float;
flat in vec3 vColour;
flat in vec3 vConic;
flat in float vOpacity;
in vec2 vAway;
out vec4 oShare;
void main() {
  float far = 0.5 * (vConic.x * vAway.x * vAway.x + vConic.z * vAway.y * vAway.y) + vConic.y * vAway.x * vAway.y;
  float alpha = min(0.999, vOpacity * exp(-far));
  if (alpha < 1.0 / 255.0) discard;
  oShare = vec4(vColour * alpha, alpha);
}`;

const FINISH_VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1);
}`;

// The sky behind the Gaussians and the exposure over both. Row 0 of the splats is the upper one.
const FINISH_FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D uSplats, uSky;
uniform bool uHasSky;
uniform vec2 uAzimuth, uElevation, uFocal, uCentre, uSize;
uniform mat3 uWorldFromCamera;
uniform mat4x3 uExposure;
out vec4 oColour;
const float PI = 3.14159265358979;
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, uSize.y - gl_FragCoord.y);
  vec4 seen = texelFetch(uSplats, ivec2(pixel), 0);
  vec3 colour = seen.rgb;
  if (uHasSky) {
    vec3 ray = uWorldFromCamera * vec3((pixel - uCentre) / uFocal, 1);
    float azimuth = atan(ray.x, ray.z) - 0.5 * (uAzimuth.x + uAzimuth.y);
    azimuth = mod(azimuth + PI, 2.0 * PI) - PI;
    float elevation = atan(-ray.y, length(ray.xz)) - 0.5 * (uElevation.x + uElevation.y);
    vec2 place = 0.5 + vec2(azimuth / (uAzimuth.y - uAzimuth.x), -elevation / (uElevation.y - uElevation.x));
    colour += (1.0 - seen.a) * texture(uSky, place).rgb;
  }
  oColour = vec4(clamp(uExposure * vec4(colour, 1), 0.0, 1.0), 1);
}`;
