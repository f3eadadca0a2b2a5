/* A libcuda.so.1 of long ago, for a test: all that CUDA's runtime asks of a driver before it
 * refuses it. */
int cuDriverGetVersion(int* version);
int cuDriverGetVersion(int* version) {
    *version = 10020;
    return 0;
}
int cuInit(unsigned flags);
int cuInit(unsigned flags) {
    (void)flags;
    return 0;
}
