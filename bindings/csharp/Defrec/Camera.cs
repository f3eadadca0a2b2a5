namespace Defrec
{
    public partial struct Camera
    {
        /// <summary>A rectified pair of cameras.</summary>
        public Camera(
            double fx, double fy, double cx, double cy, double baselineMm,
            double disparityOffsetPx = 0)
        {
            Fx = fx;
            Fy = fy;
            Cx = cx;
            Cy = cy;
            BaselineMm = baselineMm;
            DisparityOffsetPx = disparityOffsetPx;
        }
    }
}
