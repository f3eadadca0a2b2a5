// Stage align, sections 3 to 6: one work group samples a patch, searches it and refines its
// position. All sums are of integers, so that their order does not show.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "backends/stages/align.hpp"
#include "align_math.glsl"
#include "align_push.h"

const int kLanes =
    32;  // more gain nothing on a GPU, whose patches fill it, and cost lavapipe twice the time
layout(local_size_x = kLanes) in;

layout(constant_id = 0) const int kRadius = 5;
layout(constant_id = 1) const int kSearch = 4;

layout(std430, set = 0, binding = 0) readonly buffer Predictions { PatchPrediction predictions[]; };
layout(std430, set = 0, binding = 1) readonly buffer Centres { AlignCentre centres[]; };
layout(std430, set = 0, binding = 2) readonly buffer Views { uint8_t views[]; };  // doubled
layout(std430, set = 0, binding = 3) readonly buffer Gray { uint gray[]; };       // four pixels
layout(std430, set = 0, binding = 4) readonly buffer Mask { uint mask[]; };
layout(std430, set = 0, binding = 5) readonly buffer Counts {
    vec2 of_count[];
};  // 1 / n, sqrt(n) at n
layout(std430, set = 0, binding = 6) writeonly buffer Observations {
    PatchObservation observations[];
};
layout(push_constant) uniform Push {
    AlignConstants push;
    AlignRun run;
};

const int kSide = 2 * kRadius + 1, kPixels = kSide * kSide;
const int kPixelsPerLane = (kPixels + kLanes - 1) / kLanes;
const int kSampled = kSide + 2;       // with one pixel more on every side
const int kBlocks = (kSide + 3) / 4;  // of four columns
const int kPlaces = 2 * kSearch + 1;  // displacements in a row
// The window of the live image that the search and the refinement see, four pixels in a word. Its
// first row is that of displacement -kSearch less one; that displacement's begins with the second
// word.
const int kWindowRows = kSide + kPlaces + 1, kWindowWords = (kPlaces + 3) / 4 + kBlocks + 1,
          kWindow = kWindowRows * kWindowWords;
const int kSampledPerLane = (kSampled * kSampled + kLanes - 1) / kLanes,
          kWindowPerLane = (kWindow + kLanes - 1) / kLanes;
const int kMaxSums = 21, kParts = kLanes / 8;

shared int sampled[kSampled * kSampled];
shared uint template_pairs[kSide * 2 * kBlocks];  // two of T in 16 bits each; 0 beyond the patch
shared uint live[kWindow];
shared uint usable[kWindow];  // 255 or 0 for each pixel
shared int shifted_rows[(kSide + 3) * kSide];
shared int addends[kMaxSums * kLanes], parts[kMaxSums * kParts], sums[kMaxSums];
shared int some_hidden, best_score, best_place;

int lane;  // gl_LocalInvocationIndex

void give(int sum, int addend) { addends[sum * kLanes + lane] = addend; }
// sums[i] = the sum of what all lanes gave, for the first `count`. Synchronises.
void add_up(int count) {
    barrier();
    for (int i = lane; i < count * kParts; i += kLanes) {
        const int first = i / kParts * kLanes + i % kParts;
        int sum = 0;
        for (int k = 0; k < kLanes; k += kParts) sum += addends[first + k];
        parts[i] = sum;
    }
    barrier();
    if (lane < count) {
        int sum = 0;
        for (int k = 0; k < kParts; ++k) sum += parts[lane * kParts + k];
        sums[lane] = sum;
    }
    barrier();
}

uint bytes_from(uint word, uint next, int byte) {
    return (word >> (8 * byte)) | ((next << 1) << (31 - 8 * byte));
}
// Whether a pixel lies in the image with `border` more on every side.
bool inside(ivec2 pixel, int border) {
    return all(greaterThanEqual(pixel, ivec2(border))) &&
           all(lessThan(pixel + border, ivec2(push.width, push.height)));
}
ivec4 bytes(uint word) { return ivec4(uvec4(word, word >> 8, word >> 16, word >> 24) & 255u); }

// ---- section 3 --------------------------------------------------------------

bool followed(PatchPrediction p) {
    bool good = p.valid == 1 && p.u >= 0 && p.v >= 0 && p.u <= push.max_u && p.v <= push.max_v;
    for (int i = 0; i < 4; ++i)
        good = good && p.view_from_live[i] >= -kMaxMatrix && p.view_from_live[i] <= kMaxMatrix;
    return good;
}

int view_at(int first, int x, int y) { return int(views[first + y * push.view_width + x]); }

// The template into `sampled`, 1/16 gray level. Gives the sums of the patch, of its squares, and
// how many samples lie outside the view. What is loaded does not depend on that, so that a GPU has
// the loads of several samples under way at a time.
void sample_view(AlignCentre centre, int matrix[4], ivec2 fraction) {
    const int first = centre.view * push.view_width * push.view_height;
    const ivec2 last = ivec2(push.view_width, push.view_height) - 2;
    int sum = 0, squares = 0, outside = 0;
    [[unroll]] for (int k = 0; k < kSampledPerLane; ++k) {
        const int i = min(lane + k * kLanes, kSampled * kSampled - 1);
        const ivec2 o = ivec2(i % kSampled, i / kSampled) - (kRadius + 1),
                    d = kPatchOne * o - fraction;
        const ivec2 at =
            256 * ivec2(centre.x, centre.y) +
            ((ivec2(matrix[0] * d.x + matrix[1] * d.y, matrix[2] * d.x + matrix[3] * d.y) + 128) >>
             8);
        const ivec2 corner = at >> 15, beyond = (at >> 7) & 255,
                    place = clamp(corner, ivec2(0), last);
        const int upper = view_at(first, place.x, place.y) * (256 - beyond.x) +
                          view_at(first, place.x + 1, place.y) * beyond.x;
        const int lower = view_at(first, place.x, place.y + 1) * (256 - beyond.x) +
                          view_at(first, place.x + 1, place.y + 1) * beyond.x;
        const int value = (upper * (256 - beyond.y) + lower * beyond.y + 2048) >> 12;
        const bool counts = lane + k * kLanes < kSampled * kSampled;
        if (place != corner) outside = 1;
        if (counts) sampled[i] = value;
        if (counts && max(abs(o.x), abs(o.y)) <= kRadius) {
            sum += value;
            squares += value * value;  // of 225 values up to 4080: fits 32 bits unsigned
        }
    }
    give(0, sum);
    give(1, squares);
    give(2, outside);
}

// Four bytes of an image, from any place on; before the image is what is never asked for.
uint gray_from(int at) {
    const int word = at >> 2;
    return bytes_from(gray[max(word, 0)] & (word < 0 ? 0u : ~0u), gray[word + 1], at & 3);
}
uint mask_from(int at) {
    const int word = at >> 2;
    return bytes_from(mask[max(word, 0)] & (word < 0 ? 0u : ~0u), mask[word + 1], at & 3);
}

// Pixels outside the image are 0, and usable: what sees them is not scored.
void load_window(ivec2 corner) {
    [[unroll]] for (int k = 0; k < kWindowPerLane; ++k) {
        const int i = min(lane + k * kLanes, kWindow - 1);
        const int y = corner.y + i / kWindowWords, x = corner.x + 4 * (i % kWindowWords);
        const int at = clamp(y, 0, push.height - 1) * run.stride + clamp(x, -3, push.width - 1);
        // The word's pixels that lie in the image.
        const int first = clamp(-x, 0, 4), end = clamp(push.width - x, 0, 4);
        const uint inside = y >= 0 && y < push.height && first < end
                                ? (~0u >> (32 - 8 * (end - first))) << (8 * first)
                                : 0u;
        uint hidden = 0u;
        if (run.masked != 0) {
            const uint seen = mask_from(at);  // a byte that is not 0: usable
            const uint any = ((seen & 0x7f7f7f7fu) + 0x7f7f7f7fu) | seen;
            hidden = inside & ~(((any >> 7) & 0x01010101u) * 255u);
        }
        const uint pixels = gray_from(at) & inside;
        if (lane + k * kLanes >= kWindow) continue;
        live[i] = pixels;
        usable[i] = ~hidden;
        if (hidden != 0u) atomicOr(some_hidden, 1);
    }
}

// ---- section 4 --------------------------------------------------------------

struct Correlation {
    int n, t, tt, i, ii, ti;
};
int sum_of(ivec4 v) { return v.x + v.y + v.z + v.w; }
int dot4(ivec4 a, ivec4 b) { return sum_of(a * b); }

// Four pixels' bits that lie within the patch.
uint within(int block) { return block < kBlocks - 1 ? ~0u : ~0u >> (8 * (4 * kBlocks - kSide)); }
ivec4 template_at(int row, int block) {
    const int i = 2 * (row * kBlocks + block);
    const ivec2 pairs = ivec2(template_pairs[i], template_pairs[i + 1]);
    return ivec4(pairs << 16, pairs).xzyw >> 16;
}

// Correlates the patch's rows `row` .. last - 1, displaced. at: the word of the window with the
// first pixel, which is that byte of it.
Correlation correlate(int at, int byte, int row, int last) {
    const bool masked = some_hidden != 0;
    Correlation sums = Correlation(0, 0, 0, 0, 0, 0);
    for (at += row * kWindowWords; row < last; ++row, at += kWindowWords) {
        for (int block = 0; block < kBlocks; ++block) {
            uint pixels = bytes_from(live[at + block], live[at + block + 1], byte) & within(block);
            const ivec4 t = template_at(row, block);
            if (masked) {
                const uint seen =
                    bytes_from(usable[at + block], usable[at + block + 1], byte) & within(block);
                pixels &= seen;
                const ivec4 n = bytes(seen & 0x01010101u);
                sums.n += sum_of(n);
                sums.t += dot4(t, n);
                sums.tt += dot4(t * t, n);
            }
            const ivec4 i = bytes(pixels);
            sums.i += sum_of(i);
            sums.ii += dot4(i, i);
            sums.ti += dot4(t, i);
        }
    }
    return sums;
}

// ZNCC, 1/65536.
int score_of(int n, int t, int tt, int i, int ii, int ti) {
    const int live_variance = int(uint(n) * uint(ii) - uint(i) * uint(i));
    if (4 * n < 3 * kPixels || live_variance < 1) return kUnscored;
    const vec2 count = of_count[n];
    const float patch_variance = covariance(t, t, tt, count.x);
    if (!(patch_variance >= 1.0)) return kUnscored;
    const float patch_root = reciprocal_sqrt(patch_variance),
                live_root = reciprocal_sqrt(float(live_variance));
    precise const float z =
        (((covariance(t, i, ti, count.x) * patch_root) * live_root) * count.y) * float(kOneScore) +
        0.5;
    return int(floor(z));
}

// Displacements in rows, `step` apart, every second row `shift` further on.
struct Displacements {
    ivec2 first;
    int columns, rows;
    ivec2 step;
    int shift;
};
ivec2 displacement_at(Displacements grid, int place) {
    const int row = place / grid.columns;
    return grid.first + grid.step * ivec2(place % grid.columns, row) +
           ivec2(row % 2 * grid.shift, 0);
}
// Those that are scored first; the last of a row may lie beyond the radius.
Displacements first_displacements() {
    const int even = kSearch / 2 * 2;
    if (kSearch > kEvenSearch)
        return Displacements(ivec2(-kSearch), kSearch + 1, 2 * kSearch + 1, ivec2(2, 1), 1);
    return Displacements(ivec2(-even), even + 1, even + 1, ivec2(2), 0);
}

// The best displacement from the pixel at; its score is kUnscored where none is scored. Where they
// are few, lanes share the rows of each. t, tt: of the whole patch.
struct Best {
    ivec2 displacement;
    int score;
};
Best best_of(ivec2 at, Displacements grid, int t, int tt) {
    const int count = grid.columns * grid.rows, groups = min(count, kLanes),
              shares = kLanes / groups, rows = (kSide + shares - 1) / shares, share = lane / groups;
    int own_score = kUnscored, own_place = 0;
    if (lane == 0) {
        best_score = kUnscored;
        best_place = count;
    }
    for (int start = 0; start < count; start += groups) {
        const int place = start + lane % groups;
        const ivec2 d = displacement_at(grid, place),
                    window = clamp(d, ivec2(-kSearch - 1), ivec2(kSearch + 1)) + kSearch;
        const int byte = 4 + window.x;
        Correlation sums =
            correlate((window.y + 1) * kWindowWords + (byte >> 2), byte & 3, share * rows,
                      share < shares ? min((share + 1) * rows, kSide) : 0);
        if (shares > 1) {
            give(0, sums.n);
            give(1, sums.t);
            give(2, sums.tt);
            give(3, sums.i);
            give(4, sums.ii);
            give(5, sums.ti);
            barrier();
            for (int other = lane + groups; other < shares * groups; other += groups) {
                sums.n += addends[other];
                sums.t += addends[kLanes + other];
                sums.tt += addends[2 * kLanes + other];
                sums.i += addends[3 * kLanes + other];
                sums.ii += addends[4 * kLanes + other];
                sums.ti += addends[5 * kLanes + other];
            }
        }
        if (lane >= groups || place >= count || max(abs(d.x), abs(d.y)) > kSearch ||
            !inside(at + d, kRadius))
            continue;
        if (some_hidden == 0) {
            sums.n = kPixels;
            sums.t = t;
            sums.tt = tt;
        }
        const int score = score_of(sums.n, sums.t, sums.tt, sums.i, sums.ii, sums.ti);
        const int penalised = score - kDistancePenalty * (d.x * d.x + d.y * d.y);
        if (score == kUnscored || penalised <= own_score) continue;
        own_score = penalised;
        own_place = place;
    }
    barrier();
    atomicMax(best_score, own_score);
    barrier();
    if (own_score == best_score) atomicMin(best_place, own_place);
    barrier();
    const Best best = Best(displacement_at(grid, best_place), best_score);
    barrier();
    return best;
}

// The displacement of the best score round the pixel at; false if there is none or it lies at the
// border.
bool search(ivec2 at, int t, int tt, out ivec2 displacement) {
    const Best best = best_of(at, first_displacements(), t, tt);
    displacement = best.displacement;
    if (best.score == kUnscored) return false;
    const Displacements near = Displacements(displacement - 1, 3, 3, ivec2(1), 0);
    displacement = best_of(at, near, t, tt).displacement;
    return max(abs(displacement.x), abs(displacement.y)) < kSearch;
}

// ---- section 5 --------------------------------------------------------------

struct Pixel {  // of a patch: offset from its centre, template and its gradient, 0 where not usable
    int x, y, t, gx, gy, usable;
};
const Pixel kUnusable = Pixel(0, 0, 0, 0, 0, 0);

// first: the word and byte of the window with the patch's first pixel.
Pixel pixel_at(int i, int mean, ivec2 first) {
    if (i >= kPixels) return kUnusable;
    const int x = i % kSide, y = i / kSide, at = (y + 1) * kSampled + x + 1, column = first.x + x;
    if (((usable[(first.y + y) * kWindowWords + (column >> 2)] >> (8 * (column & 3))) & 1u) == 0u)
        return kUnusable;
    const int across = sampled[at + 1] - sampled[at - 1],
              down = sampled[at + kSampled] - sampled[at - kSampled];
    return Pixel(x - kRadius, y - kRadius, sampled[at] - mean, (across + 1) >> 1, (down + 1) >> 1,
                 1);
}

TemplateSums template_sums(Pixel pixels[kPixelsPerLane]) {
    TemplateSums s = TemplateSums(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    [[unroll]] for (int k = 0; k < kPixelsPerLane; ++k) {
        const Pixel p = pixels[k];
        s.n += p.usable;
        s.x += p.x;
        s.y += p.y;
        s.xx += p.x * p.x;
        s.xy += p.x * p.y;
        s.yy += p.y * p.y;
        s.t += p.t;
        s.gx += p.gx;
        s.gy += p.gy;
        s.xt += p.x * p.t;
        s.yt += p.y * p.t;
        s.xgx += p.x * p.gx;
        s.ygx += p.y * p.gx;
        s.xgy += p.x * p.gy;
        s.ygy += p.y * p.gy;
        s.tt += p.t * p.t;
        s.gxx += p.gx * p.gx;
        s.gxy += p.gx * p.gy;
        s.gyy += p.gy * p.gy;
        s.gxt += p.gx * p.t;
        s.gyt += p.gy * p.t;
    }
    give(0, s.n);
    give(1, s.x);
    give(2, s.y);
    give(3, s.xx);
    give(4, s.xy);
    give(5, s.yy);
    give(6, s.t);
    give(7, s.gx);
    give(8, s.gy);
    give(9, s.xt);
    give(10, s.yt);
    give(11, s.xgx);
    give(12, s.ygx);
    give(13, s.xgy);
    give(14, s.ygy);
    give(15, s.tt);
    give(16, s.gxx);
    give(17, s.gxy);
    give(18, s.gyy);
    give(19, s.gxt);
    give(20, s.gyt);
    add_up(21);
    return TemplateSums(sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], sums[7],
                        sums[8], sums[9], sums[10], sums[11], sums[12], sums[13], sums[14],
                        sums[15], sums[16], sums[17], sums[18], sums[19], sums[20]);
}

// Sums of the live image shifted by `shift`.
LiveSums live_sums(Pixel pixels[kPixelsPerLane], ivec2 first, ivec2 shift) {
    const ivec4 wx = cubic_weights(shift.x & 255), wy = cubic_weights(shift.y & 255);
    const ivec2 corner = first - 1 + (shift >> 8);
    for (int i = lane; i < (kSide + 3) * kSide; i += kLanes) {
        const int column = corner.x + i % kSide,
                  at = (corner.y + i / kSide) * kWindowWords + (column >> 2);
        const ivec4 taps = wx * bytes(bytes_from(live[at], live[at + 1], column & 3));
        shifted_rows[i] = (taps.x + taps.y + taps.z + taps.w + 8) >> 4;
    }
    barrier();
    LiveSums s = LiveSums(0, 0, 0, 0, 0, 0, 0);
    [[unroll]] for (int k = 0; k < kPixelsPerLane; ++k) {
        const Pixel p = pixels[k];
        const int at = min(lane + k * kLanes, kPixels - 1);
        const int column = wy[0] * shifted_rows[at] + wy[1] * shifted_rows[at + kSide] +
                           wy[2] * shifted_rows[at + 2 * kSide] +
                           wy[3] * shifted_rows[at + 3 * kSide];
        const int i = p.usable * ((column + 512) >> 10);
        s.i += i;
        s.xi += p.x * i;
        s.yi += p.y * i;
        s.ii += i * i;
        s.it += i * p.t;
        s.igx += i * p.gx;
        s.igy += i * p.gy;
    }
    give(0, s.i);
    give(1, s.xi);
    give(2, s.yi);
    give(3, s.ii);
    give(4, s.it);
    give(5, s.igx);
    give(6, s.igy);
    add_up(7);
    return LiveSums(sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6]);
}

// ---- all --------------------------------------------------------------------

const PatchObservation kNotFound = PatchObservation(0, 0, 0, 0, float[3](0, 0, 0), 0);

// The template less its mean, in pairs for the search.
void pack_template(int mean) {
    for (int i = lane; i < kSide * 2 * kBlocks; i += kLanes) {
        const int row = i / (2 * kBlocks), column = 2 * (i % (2 * kBlocks)),
                  at = (row + 1) * kSampled + column + 1;
        const uint left = column < kSide ? uint(sampled[at] - mean) & 0xffffu : 0u;
        const uint right = column + 1 < kSide ? uint(sampled[at + 1] - mean) << 16 : 0u;
        template_pairs[i] = left | right;
    }
    barrier();
}

// From the best displacement of the predicted pixel on, whose fraction is `fraction`.
PatchObservation refine(ivec2 pixel, ivec2 fraction, ivec2 displacement, int mean) {
    const ivec2 best = pixel + displacement;
    if (!inside(best, kRadius + 2)) return kNotFound;
    const ivec2 first =
        displacement + kSearch + ivec2(4, 1);  // the patch's first pixel in the window
    Pixel pixels[kPixelsPerLane];
    [[unroll]] for (int k = 0; k < kPixelsPerLane; ++k) pixels[k] =
        pixel_at(lane + k * kLanes, mean, first);
    const TemplateSums of_template = template_sums(pixels);
    ShiftSystem system;
    ivec2 shift = ivec2(0);
    int score = 0;
    for (int k = 0; k < kShiftSteps; ++k) {
        const LiveSums of_live = live_sums(pixels, first, shift);
        ShiftStep step;
        if (k == 0)
            step = first_shift_step(of_template, of_count[of_template.n].x, of_live, system);
        else
            step = shift_step(system, of_live);
        if (!step.valid) return kNotFound;
        score = step.score;
        shift += step.by;
        if (any(lessThan(shift, ivec2(-kPatchOne))) ||
            any(greaterThanEqual(shift, ivec2(kPatchOne))))
            return kNotFound;
        if (all(lessThanEqual(abs(step.by), ivec2(kShortStep)))) break;
    }
    if (score >> kScoreShift < push.min_score) return kNotFound;
    const ivec2 found = kPatchOne * best + fraction + shift;
    return PatchObservation(from_level(found.x, push.level), from_level(found.y, push.level),
                            score >> kScoreShift, 1,
                            information(system, kPixels, score, push.level), 0);
}

// Where the patch is predicted, if that pixel's score suffices. t, tt: of the whole patch.
PatchObservation predicted_observation(PatchPrediction prediction, ivec2 pixel, int t, int tt) {
    const int q = best_of(pixel, Displacements(ivec2(0), 1, 1, ivec2(1), 0), t, tt).score;
    const int score = min(q, kOneScore) >> kScoreShift;
    if (q == kUnscored || score < push.min_score) return kNotFound;
    return PatchObservation(prediction.u, prediction.v, score, 1, float[3](0, 0, 0), 0);
}

PatchObservation observe(int index) {
    const PatchPrediction prediction = predictions[index];
    const AlignCentre centre = centres[index];
    if (!followed(prediction) || centre.valid == 0) return kNotFound;
    const ivec2 position =
        ivec2(to_level(prediction.u, push.level), to_level(prediction.v, push.level));
    const ivec2 pixel = (position + 128) >> 8, fraction = position - kPatchOne * pixel;
    if (lane == 0) some_hidden = 0;
    barrier();
    load_window(pixel - kRadius - kSearch - ivec2(4, 1));
    sample_view(centre, prediction.view_from_live, fraction);
    add_up(3);
    const int sum = sums[0], squares = sums[1], mean = (2 * sum + kPixels) / (2 * kPixels);
    const int64_t n = int64_t(kPixels), whole = int64_t(sum);
    const int64_t variance = n * int64_t(uint(squares)) - whole * whole;
    if (sums[2] != 0 || variance < n * n * int64_t(push.texture) * int64_t(push.texture))
        return kNotFound;

    pack_template(mean);
    const int t = sum - kPixels * mean, tt = squares - 2 * mean * sum + kPixels * mean * mean;
    ivec2 displacement;
    if (search(pixel, t, tt, displacement)) {
        const PatchObservation found = refine(pixel, fraction, displacement, mean);
        if (found.valid != 0) return found;
    }
    return push.keep_predicted != 0 ? predicted_observation(prediction, pixel, t, tt) : kNotFound;
}

void main() {
    lane = int(gl_LocalInvocationIndex);
    const int index = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
    if (index >= run.patches) return;
    const PatchObservation observation = observe(index);
    if (lane == 0) observations[index] = observation;
}
