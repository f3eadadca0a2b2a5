// The numbers by which a registration decides, as scripts/decisions/header.py reads them: unit |
// what it decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// A preoperative model's mesh.
struct RegistrationModel {
    // triangles | more are refused | set by hand: a liver by 0.3 mm
    static constexpr size_t kMaxTriangles = 2000000;
    // mm | a shorter longest side is refused | coordinates in metres
    static constexpr float kMinSide = 3;
    // mm | a longer one is refused | coordinates in micrometres
    static constexpr float kMaxSide = 2000;
    // 1 | a triangle whose height is a smaller share of its longest side has no area | rounding to
    //   float
    static constexpr double kMinHeight = 1e-6;
    // share of the edges | more that are open or turn differently: the mesh has no outside | set by
    //   hand
    static constexpr double kMaxOpenShare = 0.01;
};

// Where the search for a pose begins, and how much it looks at.
struct SurfaceSearch {
    // points | with which starts approach | set by hand
    static constexpr size_t kApproachPoints = 300;
    // points | of the surface that are compared in the end | set by hand: neighbours share errors
    static constexpr size_t kMaxPoints = 4000;
    // poses | where starts have ended that are refined, the best ones | set by hand
    static constexpr size_t kCandidates = 5;
    // points | with which these are refined first | set by hand
    static constexpr size_t kRefinePoints = 800;
    // times the cost of the best | of a pose that is refined with all points, at most | set by hand
    static constexpr double kWorthRefining = 1.5;
    // mm | by which the points move between poses that count as one, before they are refined | set
    //   by hand
    static constexpr double kSamePose = 3;
    // points | by which two poses are compared | set by hand
    static constexpr size_t kDistancePoints = 60;
    // points | fewer are refused | set by hand
    static constexpr size_t kMinPoints = 50;
    // mm | a coordinate farther away is refused, and a template's vertex left out | set by hand:
    // 1 km; one such point would be the middle of all
    static constexpr double kFarthest = 1e6;
    // mm | points so near each other share the model's error, for the covariance | with 25, a third
    // of organs that
    //   are bent by 0.5 mm are undetermined, [registration]
    static constexpr double kModelErrorLength = 15;
    // mm | added to the error of every point | rounding
    static constexpr double kMinPointError = 0.01;
    // mm | the distance from the middle of the points at which turns are measured, at least | set
    // by
    //   hand
    static constexpr double kMinLength = 1;
};

// How starts approach the surface.
struct SurfaceApproach {
    // steps | of least squares | set by hand
    static constexpr int kRounds = 25;
    // mm | width of Geman and McClure's kernel in the first step | set by hand
    static constexpr double kFirstWidth = 15;
    // mm | and in the last one | set by hand
    static constexpr double kLastWidth = 2;
    // share of a point's information | of every point, that holds all motions | set by hand
    static constexpr double kDamping = 0.005;
    // mm | a longer step is shortened | set by hand
    static constexpr double kMaxStep = 15;
};

// What a point counts in the end.
struct SurfaceKernel {
    // robust standard deviations | farther points count nothing | Tukey's biweight: 95 % efficient
    static constexpr double kTukey = 4.685;
    // robust standard deviations | farther points are outliers | set by hand
    static constexpr double kInlier = 3;
    // 1 | standard deviation of a normal distribution over its median deviation | 1.4826
    static constexpr double kMedianToSigma = 1.4826;
    // of the expected errors | the robust standard deviation is no less | rounding
    static constexpr double kMinScale = 0.01;
    // 1 | cosine of the angle between the normals of a point and of the model, at least | set by
    // hand
    static constexpr double kMinAgreement = 0.5;
    // share of a point's information | as kDamping of SurfaceApproach | rounding
    static constexpr double kDamping = 1e-6;
    // steps | at most | set by hand
    static constexpr int kMaxRounds = 60;
    // mm | a shorter step is the last one | set by hand
    static constexpr double kRest = 0.002;
};

// How far neighbours share an error.
struct ResidualCorrelation {
    // points | whose neighbours are looked at, about | set by hand
    static constexpr size_t kSamples = 400;
    // median distances of neighbours | width of a ring | set by hand
    static constexpr double kBin = 1.5;
    // rings | at most | set by hand
    static constexpr size_t kBins = 40;
    // 1 | a smaller correlation ends the sum | chance, between 400 points and their ring
    static constexpr double kFaded = 0.05;
};

// Motions that the data do not hold.
struct FreeMotions {
    // median angle between facets | root mean square of the angle between a motion and the surface,
    //   below which the motion is open | 0.33 to 0.35 of a sphere, 0.6 or more of an organ of 1280
    //   triangles, [registration]
    static constexpr double kFacetShare = 0.4;
    // rad | that angle, at least | set by hand
    static constexpr double kMinAngle = 0.01;
    // mm | standard deviation in the covariance along such a motion | set by hand: of no use
    static constexpr double kExpected = 1000;
    // 1 | share of a motion that is a turn; with less it is a shift | rounding
    static constexpr double kMinTurn = 0.05;
    // mm | rounding of what is printed | set by hand
    static constexpr double kTextStep = 0.01;
};

// Whether a registration may be used.
struct RegistrationVerdicts {
    // times what the errors of points and model explain | robust standard deviation of the
    // residuals;
    //   more: failed | 0.4 to 1 of right poses, 1.9 to 15 of wrong ones, [registration]
    static constexpr double kMaxRatio = 1.75;
    // mm | between two poses that are told apart | set by hand
    static constexpr double kOtherPose = 3;
    // 1 | cost of another pose that fits alike, at most | set by hand
    static constexpr double kLikeCost = 1.1;
    // 1 | or more by so much chi^2 | set by hand
    static constexpr double kChiSquared = 16;
    // 1 | negative eigenvalue of a covariance, in the largest one | rounding to float
    static constexpr double kRounding = 1e-5;
};

// The elastic body that a model's surface encloses, and the shapes that it may take.
struct ElasticModel {
    // cells | that the body is divided into, about | set by hand
    static constexpr double kCells = 1500;
    // cells | more are refused | four times as many, for bodies that are thin
    static constexpr size_t kMaxCells = 6000;
    // share of a cell | a cell that the body fills less is none | as BodyCells
    static constexpr double kMinShare = 0.05;
    // 1 | stiffness of a cell that is filled in part, at least | with its share alone cells at the
    //   rim flutter: strains of 0.3 to 1.2 where 0.1 are right, [nonrigid-registration]
    static constexpr double kMinStiffness = 0.3;
    // 1 | Poisson's ratio | soft tissue is nearly incompressible
    static constexpr double kPoissonRatio = 0.45;
    // mm | length of the springs that hold the body, with its Young's modulus | its forces are
    //   balanced: the equations need a solution
    static constexpr double kSpringLength = 10000;
    // mm | a place farther from the body is not displaced with it | larger than any model
    static constexpr double kReach = 10000;
    // root of the surface's area | width of the forces that act on it | set by hand
    static constexpr double kForceWidth = 0.1;
    // widths | between the centres of two forces, at least | set by hand
    static constexpr double kForceSpacing = 1.2;
    // of the strain, times displacement and distance from what was seen | expected error that an
    //   organ which is not such a body adds | without it 68 % of targets at 45 mm are within 2
    //   expected errors, [nonrigid-registration]
    static constexpr double kUnlikeShare = 1;
    // mm | added to that distance | with 0 mm 88 to 93 % of what is seen is within 2 expected
    // errors,
    //   [nonrigid-registration]
    static constexpr double kSeenLength = 15;
    // shapes | at most | set by hand
    static constexpr size_t kMaxModes = 120;
    // of the variance of the first shape | shapes with less are left out | rounding to float
    static constexpr double kMinPower = 1e-7;
};

// How much a model may be deformed, before the surface is looked at.
struct ShapePrior {
    // 1 | exponent of the stiffness in the prior variance of a shape, the least | 2: forces without
    //   preference
    static constexpr int kMinExponent = 2;
    // 1 | and the largest | with 8 what is local is missed, [nonrigid-registration]
    static constexpr int kMaxExponent = 4;
    // 1 | the stated scale over the smallest one by which a deformation may make the data likelier
    //   | set by hand
    static constexpr double kScaleRange = 64;
    // 1 | a scale over the next smaller one | set by hand
    static constexpr double kScaleStep = 1.41421356;
};

// How the model is drawn to the surface.
struct ElasticFit {
    // steps | of least squares, at most | set by hand
    static constexpr int kMaxRounds = 40;
    // mm | a step that moves the surface by less, root mean square, is the last one | with 0.01
    // half
    //   of a deformation is missed: the surface slides slowly, [nonrigid-registration]
    static constexpr double kRest = 0.001;
    // steps | with what the residuals say of the errors, in the end | 60 give the same,
    // [nonrigid-registration]
    static constexpr int kFinalRounds = 15;
    // share of a point's information | as kDamping of SurfaceApproach | rounding
    static constexpr double kDamping = 1e-6;
    // places | of what was seen, from which distances are told, at most | set by hand
    static constexpr size_t kSeenPlaces = 500;
};

// Whether a deformation is taken.
struct DeformationVerdicts {
    // 1 | logarithm of how much likelier the surface is with the deformation, at least | set by
    // hand:
    //   150 times
    static constexpr double kMinEvidence = 5;
    // 1 | strain of a deformation that is taken, at most | set by hand: small strains are assumed
    static constexpr double kMaxStrain = 0.5;
};

// Registration by pairs of points.
struct RegistrationPairs {
    // pairs | fewer are refused | three places fix a rigid motion
    static constexpr size_t kMinPairs = 3;
    // 1 | relative difference of a covariance from its transpose, at most | rounding to float
    static constexpr double kSymmetric = 1e-6;
    // steps | of least squares after the closed form | it is at rest after 4
    static constexpr int kRounds = 10;
    // share of a covariance's trace | added to its diagonal, so that it has an inverse | rounding
    static constexpr double kRounding = 1e-9;
    // mm | likewise | rounding
    static constexpr double kMinError = 1e-3;
    // mm | the distance from the middle at which turns are measured, at least | set by hand
    static constexpr double kMinLength = 1;
    // share of the mean information | a motion with less is open | rounding
    static constexpr double kMinShare = 1e-6;
    // mm | a coordinate of a pair that is farther away, or an error that is larger, is refused |
    // set by hand: 1 km; squares of no place overflow
    static constexpr double kFarthest = 1e6;
    // expected errors | a pair that is farther off contradicts the others | 1 of 1500 by chance
    static constexpr double kMaxRatio = 4;
    // times the variance of the residuals | likewise where errors are not stated | set by hand
    static constexpr double kMaxUnstatedRatio = 16;
};

// The start that is taken.
struct RegistrationStart {
    // 1 | element of R R^T - 1, at most | files round to six digits
    static constexpr double kRotation = 1e-3;
};

// A registration that a plan is made of or that its file holds.
struct PlanRegistration {
    // 1 | element of R^T R - 1, at most | texts with six digits leave 1e-6
    static constexpr double kRotation = 1e-5;
    // share of the largest element | by which a covariance is not symmetric, or has a negative
    //   eigenvalue in units of its variances, at most | rounding leaves 1e-12
    static constexpr double kSymmetric = 1e-6;
    // bytes | of the name of a part, at most | set by hand
    static constexpr uint64_t kMaxNameBytes = 255;
};

}  // namespace defrec::decisions
