// The numbers by which the elastic body beneath a surface decides, as scripts/decisions/header.py
// reads them: unit | what it decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// The tissue beneath a surface, where nobody tells its extent.
struct BodyExtent {
    // share of the surface's extent | depth of the body | what is deeper does not deform
    static constexpr double kDepthShare = 0.65;
    // mm | its depth at least | plans lie no deeper
    static constexpr double kMinDepth = 45;
    // share of the surface's extent | the body reaches beyond the surface's rim | set by hand
    static constexpr double kMarginShare = 0.18;
    // share of the surface's extent | length of the spring that the tissue beyond is | set by hand
    static constexpr double kBeyondShare = 0.4;
    // parts of the surface | so near the surface the body's rim is free | set by hand
    static constexpr double kFreeRimSteps = 1.2;
};

// The parts of the surface whose displacements the body is given.
struct BodyHandles {
    // mm | size of a part, and of the finest cells, as in a laparoscope's view | set by hand
    static constexpr double kUsualStep = 4.5;
    // parts | fewer, and they are made smaller | set by hand
    static constexpr size_t kMin = 150;
    // parts | more, and they are made larger | set by hand
    static constexpr size_t kMax = 230;
    // 1 | the size changes by no smaller factor at a time | set by hand
    static constexpr double kMinFactor = 0.4;
    // 1 | nor by a larger one | set by hand
    static constexpr double kMaxFactor = 2.5;
    // mm | the smallest size | set by hand
    static constexpr double kMinStep = 0.5;
    // mm | the largest size | set by hand
    static constexpr double kMaxStep = 500;
    // 1 | a smaller size must give so many times more parts | of few vertices each is a part before
    //   there are enough
    static constexpr double kMoreHandles = 1.1;
    // sizes | the centres of two parts are no nearer | set by hand
    static constexpr double kApart = 0.85;
    // sizes | so near a cut a vertex is of no part | set by hand
    static constexpr double kCutSteps = 0.5;
};

// The lattice of cells that the body is made of.
struct BodyCells {
    // finest cells | edge of the largest cell | set by hand
    static constexpr int32_t kLargest = 8;
    // edges of the cell | a cell farther from the surface is not divided | what the surface does
    //   fades with depth, and its details sooner
    static constexpr double kCoarseDistance = 1.3;
    // largest cells | a body of more is refused | set by hand
    static constexpr double kMaxCubes = 1e5;
    // cells | of a body, at most | set by hand
    static constexpr size_t kMaxCells = 12000;
    // share of a cell | a cell that the body fills less is none | set by hand
    static constexpr double kMinShare = 0.05;
    // mm | a point farther from the body follows its rigid motion | set by hand
    static constexpr double kReach = 200;
};

// Times Young's modulus of the tissue.
struct BodyStiffness {
    // 1 | tissue that a cut passes | it carries its points
    static constexpr double kCut = 0.02;
    // edges of a finest cell | springs of a held node | set by hand
    static constexpr double kHeld = 100;
    // mm | length of the springs on which a body without a held place lies | set by hand
    static constexpr double kFreeLength = 300;
    // mm | the spring of any node | set by hand
    static constexpr double kMin = 1e-7;
    // edges of a finest cell | the spring of a part | 3 % of a displacement that varies from part
    // to
    //   part are lost
    static constexpr double kData = 30;
    // of the mean influence | parts with less influence on a node are left out | set by hand
    static constexpr float kMinInfluence = 0.1f;
};

// What a vertex counts, and a part of its vertices.
struct BodyEvidence {
    // mm | expected error of a vertex that counts half | set by hand
    static constexpr double kErrorOfHalf = 0.7;
    // 1 | less counts as nothing | a place that is anywhere would pull with it
    static constexpr double kMin = 0.02;
    // 1 | the data of a part with more are taken as they are | set by hand
    static constexpr double kFull = 0.98;
};

// The rigid motion of what lies deep: the one under which the fewest parts need a force.
struct DeepMotion {
    // mm | residuals below this count alike in a robust rigid fit | set by hand
    static constexpr double kFloor = 0.15;
    // mm | likewise what the springs of parts give way | set by hand
    static constexpr double kForceFloor = 0.003;
    // mm | likewise displacements of a surface that does not deform | set by hand
    static constexpr double kNoise = 0.04;
    // mm | a surface half of which moves as a rigid body within this does not deform: its motion
    //   counts as well | set by hand
    static constexpr double kDeformed = 0.12;
    // parts | fewer that are seen say nothing of forces | set by hand
    static constexpr double kMinEvidence = 8;
    // rad | a larger turn is linearised again | the slopes are those of smaller ones
    static constexpr double kLargeTurn = 0.02;
    // mm | standard deviation of the shift against the camera's pose | breathing shifts tissue by
    //   some mm
    static constexpr double kBreathingShift = 5;
    // rad | and of the turn | breathing turns it by less than a degree
    static constexpr double kBreathingTurn = 0.009;
    // mm | standard deviation of the shift where nothing is known | set by hand
    static constexpr double kUnknownShift = 100;
    // rad | and of the turn | set by hand
    static constexpr double kUnknownTurn = 1;
};

// How much of the time a thread works on a body while frames come.
struct BodyWork {
    // of the time that was worked | it rests, unless somebody waits | frames meanwhile take 1.1
    //   times as long
    static constexpr double kRest = 1.5;
};

// A mesh that an application gives.
struct BodyMesh {
    // vertices, triangles | more are refused | set by hand
    static constexpr uint64_t kMaxCount = 1000000;
    // mm | a shorter longest side is refused | coordinates in metres
    static constexpr double kMinSide = 3;
    // mm | a longer one is refused | coordinates in micrometres
    static constexpr double kMaxSide = 2000;
    // of the longest side | a smaller mean thickness is flat | rounding to float
    static constexpr double kMinThickness = 1e-6;
    // of a coordinate | sides that meet by no more do not cross | what rounding to float and a
    //   transform before it leave
    static constexpr double kTolerance = 1e-6;
    // tolerances | thickness from which an overlap is reported | set by hand
    static constexpr double kMinOverlap = 20;
    // lines | along x and y, on which overlaps are looked for | set by hand
    static constexpr int kOverlapColumns = 128;
    // pairs of triangles | whose boxes meet: a mesh with more is refused | about 10 per triangle in
    //   usual meshes; so many take about 10 s
    static constexpr uint64_t kMaxPairs = 200000000;
    // mm | the surface is near the mesh | set by hand
    static constexpr double kNear = 8;
    // of the longest side | or within this | set by hand
    static constexpr double kNearShare = 0.1;
    // share of the surface | less of it near the mesh: it lies beside the view | set by hand
    static constexpr double kMinNearShare = 0.5;
    // vertices | of the surface that are looked at, at most | set by hand
    static constexpr size_t kMaxNearPoints = 2000;
};

}  // namespace defrec::decisions
