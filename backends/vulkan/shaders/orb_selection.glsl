// What the shaders of stage orb's selection share (docs/stages/orb.md, section 6).
const int kDistances = 64, kScores = 256;

struct Counts {  // of corners
    uint of_distance[kDistances];
    uint of_score[kDistances][kScores];
};

struct Selection {
    uint groups[3];        // of the description: one for each feature
    uint distance, score;  // corners with at least this distance, or one less and at least this score, are kept
};
