"""Keys of the page: arrows drive, space plays and pauses, N steps, F follows."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import viser

Key = Literal["arrowup", "arrowdown", "arrowleft", "arrowright", "end", "space", "N", "F"]

ARROWS: dict[str, Key] = {
    "forward": "arrowup",
    "back": "arrowdown",
    "left": "arrowleft",
    "right": "arrowright",
}
"""Keys by the name of what they do."""

# viser's camera takes arrows and WASD by their place on the keyboard, and its commands take keys by
# their names. So a listener that comes first takes these keys away from the camera, and sends them
# on as arrows without a place: pressed again for all that are held, "End" where one was let go. A
# choice that was made gives the keys back: commands take none that are meant for a form, and space
# would press a button that has them a second time.
_LISTENER = """
(() => {
  if (window.andabataKeys) return;
  const names = {ArrowUp: 'ArrowUp', ArrowDown: 'ArrowDown', ArrowLeft: 'ArrowLeft',
                 ArrowRight: 'ArrowRight', KeyW: 'ArrowUp', KeyS: 'ArrowDown',
                 KeyA: 'ArrowLeft', KeyD: 'ArrowRight'};
  const held = new Set();
  const send = (key) => document.documentElement.dispatchEvent(
    new KeyboardEvent('keydown', {key, code: 'andabata', bubbles: true, cancelable: true}));
  const isForm = (e) => ['INPUT', 'TEXTAREA', 'SELECT'].includes(e.target.tagName);
  const isOurs = (e) => e.isTrusted && names[e.code] && !isForm(e)
    && !e.ctrlKey && !e.metaKey && !e.altKey;
  window.addEventListener('keydown', (e) => {
    if (!isOurs(e)) return;
    e.stopImmediatePropagation();
    e.preventDefault();
    held.add(names[e.code]);
    held.forEach(send);
  }, true);
  const release = () => { send('End'); held.forEach(send); };
  window.addEventListener('keyup', (e) => {
    if (!names[e.code] || !held.delete(names[e.code])) return;
    e.stopImmediatePropagation();
    release();
  }, true);
  window.addEventListener('blur', () => { held.clear(); release(); });
  window.addEventListener('click', (e) => {
    if (e.target.closest && e.target.closest('[role=option], [type=checkbox], button'))
      setTimeout(() => document.activeElement && document.activeElement.blur(), 50);
  }, true);
  window.andabataKeys = true;
})()
"""


def listen(gui: "viser.GuiApi") -> None:
    """Let the page send arrows and WASD to commands instead of to the camera.

    Args:
        gui: Controls of the page.
    """
    # A script element that arrives later is not run by browsers; the handler of an image is.
    script = " ".join(_LISTENER.split()).replace('"', "&quot;")
    gui.add_html(f'<img alt="" src="data:," style="display:none" onerror="{script}">')


def bind(gui: "viser.GuiApi", key: Key, label: str, act: Callable[[], None]) -> None:
    """Let a key do something, and the palette of commands as well.

    Args:
        gui: Controls of the page.
        key: Key.
        label: Name in the palette.
        act: Function that does it.
    """
    command = gui.add_command(label, hotkey=key)

    @command.on_trigger
    def _(event: object) -> None:
        act()
