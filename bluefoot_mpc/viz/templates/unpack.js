"use strict";
// Runs the page's packed scripts, in their order.
(async function () {
  try {
    for (const item of document.querySelectorAll("script[data-packed]")) {
      const bytes = Uint8Array.from(atob(item.textContent), (c) => c.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      const script = document.createElement("script");
      script.textContent = await new Response(stream).text();
      document.head.append(script);
      item.remove();
    }
  } catch (error) {
    console.error(error);
    const note = document.createElement("p");
    note.className = "lead";
    note.textContent = "The figures cannot be drawn: this browser cannot unpack them. Any browser of 2023 or later can.";
    document.querySelector("main").prepend(note);
  }
})();
