using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    /// <summary>A closed triangle mesh in the template frame.</summary>
    public sealed class BodyMesh
    {
        /// <summary>vertices: (x, y, z, x, ...), mm. triangles: three vertex indices each, counter-clockwise seen from outside.</summary>
        /// <exception cref="ArgumentException">An argument is null, or not a multiple of 3 long.</exception>
        public BodyMesh(float[] vertices, uint[] triangles)
        {
            Check.NotNull(vertices, nameof(vertices));
            Check.NotNull(triangles, nameof(triangles));
            Check.Groups(vertices.Length, 3, nameof(vertices));
            Check.Groups(triangles.Length, 3, nameof(triangles));
            Vertices = vertices;
            Triangles = triangles;
        }

        /// <summary>xyz each, mm.</summary>
        public float[] Vertices { get; private set; }
        /// <summary>Three vertex indices each.</summary>
        public uint[] Triangles { get; private set; }
    }

    /// <summary>A part of a body that is stiffer or softer than the rest, or held.</summary>
    public sealed class BodyPart
    {
        /// <summary>mesh: what lies in it.</summary>
        /// <exception cref="ArgumentNullException">mesh is null.</exception>
        public BodyPart(BodyMesh mesh)
        {
            Check.NotNull(mesh, nameof(mesh));
            Mesh = mesh;
        }

        /// <summary>What lies in it.</summary>
        public BodyMesh Mesh { get; private set; }
        /// <summary>Young's modulus relative to the rest of the body, 0.01 to 1000; 0: 1.</summary>
        public float Stiffness { get; set; }
        /// <summary>It moves with <see cref="Frame.HeldMotion"/>, or with the deep tissue where that is not given.</summary>
        public bool IsHeld { get; set; }
    }

    /// <summary>The elastic body that a template surface belongs to.</summary>
    public sealed class BodyDescription
    {
        /// <summary>Of the whole body; null: the tissue beneath the surface, whose extent is not known.</summary>
        public BodyMesh Mesh { get; set; }
        /// <summary>At most 64; where they overlap the last one counts. May be null.</summary>
        public IList<BodyPart> Parts { get; set; }
        /// <summary>Of the tissue, 0.01 to 0.495; 0: 0.43.</summary>
        public float PoissonRatio { get; set; }
        /// <summary>How deep a cut parts the body, mm, 0.1 to 1000; 0: 10.</summary>
        public float CutDepthMm { get; set; }
    }

    /// <summary>A description as the library takes it. Its arrays stay where they are until it is disposed.</summary>
    internal sealed unsafe class PinnedBody : IDisposable
    {
        private readonly List<GCHandle> pins = new List<GCHandle>();
        internal defrec_body_desc Native;

        internal PinnedBody(BodyDescription body)
        {
            try
            {
                Native.struct_size = (uint)sizeof(defrec_body_desc);
                Native.poisson_ratio = body.PoissonRatio;
                Native.cut_depth_mm = body.CutDepthMm;
                if (body.Mesh != null) Native.mesh = Pin(body.Mesh);
                int count = body.Parts == null ? 0 : body.Parts.Count;
                var regions = new defrec_body_region[count];
                for (int i = 0; i < count; ++i)
                {
                    BodyPart part = body.Parts[i];
                    regions[i].mesh = Pin(part.Mesh);
                    regions[i].stiffness = part.Stiffness;
                    regions[i].flags = part.IsHeld ? (uint)Constants.RegionHeld : 0;
                }
                Native.regions = (defrec_body_region*)Pin(regions);
                Native.region_count = (ulong)count;
            }
            catch
            {
                Dispose();
                throw;
            }
        }

        public void Dispose()
        {
            foreach (GCHandle pin in pins) pin.Free();
            pins.Clear();
        }

        private defrec_mesh Pin(BodyMesh mesh)
        {
            return new defrec_mesh
            {
                vertices = (float*)Pin(mesh.Vertices),
                vertex_count = (ulong)(mesh.Vertices.Length / 3),
                triangles = (uint*)Pin(mesh.Triangles),
                triangle_count = (ulong)(mesh.Triangles.Length / 3)
            };
        }

        private void* Pin(Array array)
        {
            if (array.Length == 0) return null;
            GCHandle pin = GCHandle.Alloc(array, GCHandleType.Pinned);
            pins.Add(pin);
            return (void*)pin.AddrOfPinnedObject();
        }
    }
}
