using System.Runtime.CompilerServices;

// The tests hold the layouts and the declarations to the library's own lists.
[assembly: InternalsVisibleTo("Defrec.Tests")]
