// Stage stereo, section 10: what is known of a sample of full resolution in one word: the
// hypothesis, the confidence, and from bit 24 on the difference of its disparity to the hypothesis,
// plus 16; 63 for a hole. Differences are at most 16, hypotheses less than 32768; where there is no
// hypothesis there is none anywhere.

const uint kNoEvidence = 63u << 24;

uint no_evidence(int hypothesis) { return kNoEvidence | uint(max(hypothesis, 0)); }
uint evidence_of(int hypothesis, int difference, int confidence) {
    return uint(hypothesis) | uint(confidence) << 16 | uint(difference + 16) << 24;
}
bool is_evidence(uint word) { return word < kNoEvidence; }
int hypothesis_of(uint word) { return int(word & 0xffffu); }
int difference_of(uint word) { return int(word >> 24) - 16; }
int confidence_of(uint word) { return int(word >> 16 & 255u); }
