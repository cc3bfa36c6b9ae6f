"""Operators: programs run beside Blender with progress, and Escape or a button cancels them."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import bpy
import numpy as np

from . import settings, ways
from .programs import Job, ProgramError, find

POLL_SECONDS = 0.2
# RuntimeError is also what operators of Blender raise, ReferenceError what removed objects do.
FAILURES = (ProgramError, RuntimeError, ReferenceError, ValueError, OSError)
THUMBNAIL_EDGE = 128


Jobs = Generator[Job, None, None]


class Run:
    """Programs one after another, as a way yields them. A program's error is raised there."""

    active: Run | None = None

    def __init__(self, jobs: Jobs) -> None:
        self._jobs = jobs
        self._job: Job | None = None
        self.is_cancelled = False

    @property
    def progress(self) -> float:
        return self._job.progress if self._job else 0.0

    def advance(self) -> bool:
        """Start the next program if none runs; false when all have ended."""
        while True:
            try:
                if self._job and self._job.is_running():
                    return True
            except ProgramError as error:
                self._job = self._after(error)
            else:
                self._job = next(self._jobs, None)
            if self._job is None:
                return False

    def _after(self, error: ProgramError) -> Job | None:
        try:
            return self._jobs.throw(error)
        except StopIteration:
            return None

    def finish(self) -> None:
        """Run to the end without returning to Blender."""
        while self.advance():
            self._job.wait()

    def cancel(self) -> None:
        self.is_cancelled = True
        if self._job:
            self._job.cancel()
        self._jobs.close()


class RunsPrograms:
    """An operator whose jobs(context) yields programs: modal in a window, at once without."""

    _timer: bpy.types.Timer | None = None

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return Run.active is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            Run(self.jobs(context)).finish()
        except FAILURES as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if context.window is None or bpy.app.background:
            return self.execute(context)
        Run.active = Run(self.jobs(context))
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        run = Run.active
        if run is None or run.is_cancelled or event.type == "ESC":
            self.cancel(context)
            self.report({"INFO"}, "Cancelled")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            is_running = run.advance()
        except FAILURES as error:
            self.cancel(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.progress_update(int(100 * run.progress))
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        if is_running:
            return {"PASS_THROUGH"}
        self._end(context)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        if Run.active:
            Run.active.cancel()
        self._end(context)

    def _end(self, context: bpy.types.Context) -> None:
        Run.active = None
        context.window_manager.progress_end()
        if self._timer:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None


class SOLIDTEX_OT_make_material(RunsPrograms, bpy.types.Operator):
    """Give the active object the material, baking it where that is needed"""

    bl_idname = "solidtex.make_material"
    bl_label = "Make material"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        target = context.active_object
        if target is None or target.type != "MESH" or target.mode != "OBJECT":
            cls.poll_message_set("Expected an active mesh object in Object Mode")
            return False
        return super().poll(context)

    def jobs(self, context: bpy.types.Context) -> Jobs:
        chosen = context.scene.solidtex
        if settings.number_of_model(chosen) is None:
            find("solidtex-bake")
            where = ", ".join(map(str, settings.model_folders()))
            wanted = f"model {chosen.chosen}" if chosen.chosen else "model"
            raise ProgramError(
                f"Found no {wanted} in {where}. Choose another model, or set the folder of your "
                "models in Edit > Preferences > Add-ons > Solidtex"
            )
        yield from ways.make(context.active_object, chosen)


class SOLIDTEX_OT_refresh_models(RunsPrograms, bpy.types.Operator):
    """Look for models again, and make the thumbnails that are missing"""

    bl_idname = "solidtex.refresh_models"
    bl_label = "Look for models"

    def jobs(self, _context: bpy.types.Context) -> Jobs:
        settings.refresh()
        for model in settings.models():
            if settings.thumbnail(model) is not None:
                continue
            bake = find("solidtex-bake")
            out = settings.thumbnail_to_make(model)
            try:
                yield Job([bake, model, "--preview", out, "--force"])
                _crop(out)
            except FAILURES as error:
                self.report({"WARNING"}, f"{model.stem} gets no thumbnail: {error}")
        settings.refresh()


def _crop(path: Path) -> None:
    """Keep the cube of a preview of solidtex-bake, which is the square on its left, small."""
    image = bpy.data.images.load(str(path))
    try:
        width, height = image.size
        values = np.empty((height, width, 4), np.float32)
        image.pixels.foreach_get(values.ravel())
        cube = bpy.data.images.new("solidtex", height, height)
        cube.pixels.foreach_set(values[:, :height].ravel())
        cube.scale(THUMBNAIL_EDGE, THUMBNAIL_EDGE)
        cube.file_format = "PNG"
        cube.save(filepath=str(path))
        bpy.data.images.remove(cube)
    finally:
        bpy.data.images.remove(image)


class SOLIDTEX_OT_cancel(bpy.types.Operator):
    """Stop the program that runs; no file is left behind"""

    bl_idname = "solidtex.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return Run.active is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        cancel_all()
        return {"FINISHED"}


def cancel_all() -> None:
    """Stop what runs; the modal operator ends at its next event."""
    if Run.active:
        Run.active.cancel()


CLASSES = (SOLIDTEX_OT_make_material, SOLIDTEX_OT_refresh_models, SOLIDTEX_OT_cancel)
