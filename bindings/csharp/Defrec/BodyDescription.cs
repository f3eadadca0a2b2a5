using System.Collections.Generic;

namespace Defrec
{
    /// <summary>A triangle mesh in the template frame.</summary>
    public sealed class TriangleMesh
    {
        /// <summary>xyz each, mm; at most 1,000,000 vertices.</summary>
        public float[] Vertices { get; set; } = new float[0];
        /// <summary>
        /// Three vertex indices each, counter-clockwise seen from outside; at most 1,000,000
        /// triangles.
        /// </summary>
        public uint[] Triangles { get; set; } = new uint[0];

        /// <summary>Without vertices.</summary>
        public TriangleMesh() { }

        /// <summary>A mesh of these arrays, which are not copied.</summary>
        public TriangleMesh(float[] vertices, uint[] triangles)
        {
            Vertices = vertices;
            Triangles = triangles;
        }
    }

    /// <summary>A part of a body that is stiffer or softer than the rest, or held.</summary>
    public sealed class BodyRegion
    {
        /// <summary>Closed; what lies in it.</summary>
        public TriangleMesh Mesh { get; set; } = new TriangleMesh();
        /// <summary>
        /// Young's modulus relative to the rest of the body; 0.01 to 1000; default 1.
        /// </summary>
        public float Stiffness { get; set; }
        /// <summary>
        /// What lies in it moves with <see cref="Frame.HeldMotion"/>, or with the deep tissue where
        /// that is not given.
        /// </summary>
        public bool IsHeld { get; set; }
    }

    /// <summary>
    /// The elastic body that a template belongs to: <see cref="Template.SetBody"/>. Zero means the
    /// default.
    /// </summary>
    public sealed class BodyDescription
    {
        /// <summary>
        /// Closed; of the whole body. null or without vertices: the tissue beneath the surface,
        /// whose extent is not known.
        /// </summary>
        public TriangleMesh Mesh { get; set; }
        /// <summary>Where regions overlap the last one counts; at most 64.</summary>
        public IList<BodyRegion> Regions { get; } = new List<BodyRegion>();
        /// <summary>Poisson's ratio of the tissue; 0.01 to 0.495; default 0.43.</summary>
        public float PoissonRatio { get; set; }
        /// <summary>How deep a cut parts the body, mm; 0.1 to 1000; default 10.</summary>
        public float CutDepthMm { get; set; }
    }
}
