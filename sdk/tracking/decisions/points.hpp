// The numbers by which the tracker decides where points are that lie beside the surface or beneath
// it, as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <cstddef>

namespace defrec::decisions {

// Points beside the surface, by the disparities round a pixel.
struct BesideSurface {
    // steps of the grid | disparities within this give the plane of a point | set by hand
    static constexpr double kBesideReach = 3;
    // px | and at least within this | set by hand
    static constexpr int kMinBesideReach = 3;
};

// Whether a point lies on the surface or beneath it, and what beneath it is known.
struct BeneathSurface {
    // steps of the grid | a point so near a vertex may lie on the surface | set by hand
    static constexpr double kNearSteps = 2.5;
    // steps of the grid | it does where its depth is no more than this | set by hand
    static constexpr double kOnSurfaceSteps = 0.5;
    // mm | and this much | set by hand
    static constexpr double kOnSurface = 0.1;
    // mm | further depth over which the surface's answer passes into the body's | set by hand
    static constexpr double kBlend = 3;
    // vertices | of a piece that give its rigid motion where there is no body, at most | set by
    //   hand
    static constexpr size_t kRigidVertices = 400;
    // mm | depth over which the surface's own motion fades where there is no body | set by hand
    static constexpr double kRigidFade = 10;
    // share | less seen of what a point depends on: it is unknown | set by hand
    static constexpr double kMinEvidence = 0.02;
    // mm | a point with a larger expected error is unknown | set by hand
    static constexpr double kMaxError = 10;
    // mm | a point farther beyond the body is unknown | set by hand
    static constexpr double kMaxBeyond = 20;
};

// The variance of the error of a point beneath the surface is a sum of shares.
// Source: chosen on the first three groups of bodies of docs/api/beneath.md, their growth with the
//   depth on all four
struct BeneathError {
    // 1 | the surface's squared error: errors of many vertices go into one point
    static constexpr double kSurface = 0.04;
    // 1 | the squared deformation that reaches the point, times c + (depth / `depth`)^2: other
    //   bodies would make something else of it
    static constexpr double kDeformation = 0.12;
    // 1 | likewise its squared shift against what lies deep
    static constexpr double kShift = 0.01;
    // 1 | c
    static constexpr double kConstant = 0.13;
    // mm | see `deformation`
    static constexpr double kDepth = 29;
    // mm | depth counts up to here
    static constexpr double kDeepest = 75;
    // 1 | the squared distance of the rigid motions that could be chosen for what lies deep
    static constexpr double kChoice = 0.05;
    // mm^2 | of every point
    static constexpr double kFloor = 0.0007;
    // 1 | the squared distance from the body
    static constexpr double kBeyond = 0.02;
    // 1 | the mean square of what the rest of the surface does, where nothing was seen of what the
    //   point depends on
    static constexpr double kActivity = 1.5;
    // mm^2 | and besides
    static constexpr double kUnseen = 0.25;
};

}  // namespace defrec::decisions
